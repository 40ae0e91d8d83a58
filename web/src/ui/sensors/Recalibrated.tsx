// What came of finding one sensor's place anew.

import { dialog } from "../../state/store";
import { recalibrate, recalibration } from "../../state/sensors";
import { Details } from "../calibrate/Details";
import { VerdictWord } from "../calibrate/Result";
import { Modal } from "../Modal";

export function RecalibratedDialog() {
  const r = recalibration.value;
  return (
    <Modal name="recalibrated" title={r.kind === "none" ? "Recalibration" : `Recalibration of ${r.sensor}`} wide>
      {r.kind === "busy" && <p role="status">Solving from what all sensors saw of late …</p>}
      {r.kind === "failed" && (
        <p class="card-trouble bad" role="alert" data-testid="recalibrate-trouble">
          {r.trouble}
        </p>
      )}
      {r.kind === "done" && (
        <div class="result" data-testid="recalibrate-result">
          <VerdictWord result={r.result} inForce={r.result.inForce} />
          <Details result={r.result} />
        </div>
      )}
      {(r.kind === "done" || r.kind === "failed") && (
        <div class="row">
          <button type="button" class="primary" onClick={() => (dialog.value = "none")}>
            Close
          </button>
          <button type="button" onClick={() => void recalibrate(r.sensor)}>
            Try again
          </button>
        </div>
      )}
    </Modal>
  );
}
