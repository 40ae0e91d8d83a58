// The calibration in force, and the ways to a new one and to the old ones.

import { SensorState } from "../../gen/posefuse/v1/room_pb";
import { ago, madeFrom, plural } from "../../model/format";
import { storedVerdict } from "../../model/verdict";
import { openCalibrations } from "../../state/calibrations";
import { calibrateBlocked, canCalibrate, connection, dialog, sensors, status } from "../../state/store";
import { useNow } from "../Banners";
import { openCalibrate } from "../keys";

export function CalibrationCard() {
  const now = useNow(10_000);
  const calibration = status.value?.calibration;
  // Whoever is gone again may have been a test.
  const missing = sensors.value.filter((s) => !s.calibrated && s.state !== SensorState.DISCONNECTED).length;
  const verdict = calibration?.verdict ? storedVerdict(calibration.verdict) : null;
  const history = () => {
    openCalibrations();
    dialog.value = "calibrations";
  };
  return (
    <section class="panel" aria-labelledby="calibration-title">
      <header class="panel-head">
        <h2 id="calibration-title">Calibration</h2>
        <div class="row">
          <button type="button" class="quiet small" data-testid="calibrations-button" disabled={connection.value.kind !== "online"} title="Calibrations that are kept: compare, restore, save, read" onClick={history}>
            Kept …
          </button>
          <button type="button" data-testid="calibrate-button" aria-keyshortcuts="k" disabled={!canCalibrate.value} title={calibrateBlocked.value || undefined} onClick={openCalibrate}>
            Calibrate <kbd>K</kbd>
          </button>
        </div>
      </header>
      <div class="panel-body" data-testid="calibration-state">
        {calibration ? (
          <>
            <p>
              {verdict && (
                <strong class={verdict.kind}>
                  <span aria-hidden="true">{verdict.icon}</span> {verdict.word} ·{" "}
                </strong>
              )}
              {plural(calibration.sensors.length, "sensor")}, {madeFrom(calibration.method, calibration.floor)}
              {calibration.created && <> · {ago(Date.parse(calibration.created), now)}</>}
            </p>
            {missing > 0 && <p class="warn-text">▲ {plural(missing, "sensor is", "sensors are")} not in it. Calibrate again.</p>}
          </>
        ) : (
          <p class="muted">{status.value ? "None in force. People are fused once the sensors' places are known." : "–"}</p>
        )}
      </div>
    </section>
  );
}
