// The calibration in force, and the way to a new one.

import { ago, madeFrom, plural } from "../model/format";
import { calibrateBlocked, canCalibrate, sensors, status } from "../state/store";
import { useNow } from "./Banners";
import { openCalibrate } from "./keys";

export function CalibrationCard() {
  const now = useNow(10_000);
  const calibration = status.value?.calibration;
  const missing = sensors.value.filter((s) => !s.calibrated).length;
  return (
    <section class="panel" aria-labelledby="calibration-title">
      <header class="panel-head">
        <h2 id="calibration-title">Calibration</h2>
        <button type="button" data-testid="calibrate-button" aria-keyshortcuts="k" disabled={!canCalibrate.value} title={calibrateBlocked.value || undefined} onClick={openCalibrate}>
          Calibrate <kbd>K</kbd>
        </button>
      </header>
      <div class="panel-body" data-testid="calibration-state">
        {calibration ? (
          <>
            <p>
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
