// Banners of sensors that no longer stand where the calibration says, each with what to do about it.

import { alarmsOf, type Alarm } from "../../model/drift";
import { mute, muting, recalibrate, recalibration } from "../../state/sensors";
import { sensors } from "../../state/store";

export function Alarms() {
  return (
    <>
      {alarmsOf(sensors.value).map((alarm) => (
        <MovedBanner key={alarm.sensor} alarm={alarm} />
      ))}
    </>
  );
}

function MovedBanner({ alarm: { sensor, what, remedy, muted } }: { alarm: Alarm }) {
  return (
    <div class="banner warn" data-testid="drift-alarm" data-sensor={sensor}>
      <span class="icon" aria-hidden="true">▲</span>
      <span role="alert">
        <strong>{what}.</strong> {remedy}
      </span>
      <span class="grow" />
      <RecalibrateButton sensor={sensor} kind="primary" />
      {muted ? (
        <span class="muted">It is muted.</span>
      ) : (
        <button type="button" disabled={muting.value.has(sensor)} aria-label={`Mute ${sensor}`} onClick={() => void mute(sensor, true)}>
          Mute
        </button>
      )}
    </div>
  );
}

export function RecalibrateButton({ sensor, kind = "" }: { sensor: string; kind?: string }) {
  const busy = recalibration.value.kind === "busy" ? recalibration.value.sensor : null;
  return (
    <button type="button" class={kind} disabled={busy !== null} data-testid="recalibrate-button" onClick={() => void recalibrate(sensor)}>
      {busy === sensor ? "Recalibrating …" : `Recalibrate ${sensor}`}
    </button>
  );
}
