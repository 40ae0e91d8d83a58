// What the plots draw: joint speeds of everybody in view and each sensor's residual over the last 30 s, and how far each
// sensor has drifted over the last minutes.

import { SensorState, type RoomStatus, type SensorStatus } from "../gen/posefuse/v1/room_pb";
import { secondsOf, type Frame } from "../model/frame";
import { PLOTTED_JOINTS } from "../model/joints";
import { Series, SpeedMeter } from "../model/series";

export const SPAN = 30;
/** Tripods sink slowly. */
export const DRIFT_SPAN = 300;
const DRIFT_STEP = 1;

interface Followed {
  lastTime: number;
  meters: SpeedMeter[];
  speeds: Series[];
}

const people = new Map<string, Followed>();
const residuals = new Map<string, Series>();
const drifts = new Map<string, DriftSeries>();

interface DriftSeries {
  /** Median distance to the fusion of the others, mm. */
  residual: Series;
  /** How far it seems to have moved since it was calibrated, mm. */
  moved: Series;
}

export function recordSpeeds(frame: Frame): void {
  for (const person of frame.people) {
    let entry = people.get(person.id);
    if (!entry) {
      entry = {
        lastTime: frame.time,
        meters: PLOTTED_JOINTS.map(() => new SpeedMeter()),
        speeds: PLOTTED_JOINTS.map(() => new Series(SPAN)),
      };
      people.set(person.id, entry);
    }
    entry.lastTime = frame.time;
    for (let i = 0; i < PLOTTED_JOINTS.length; i++) {
      const joint = person.joints[PLOTTED_JOINTS[i]!.joint];
      if (!joint) continue;
      const speed = entry.meters[i]!.push(frame.time, joint.x, joint.y, joint.z);
      if (speed !== null) entry.speeds[i]!.push(frame.time, speed);
    }
  }
  for (const [id, entry] of people) if (Math.abs(frame.time - entry.lastTime) > SPAN) people.delete(id);
}

export function speedsOf(id: string | null): Series[] {
  return (id !== null && people.get(id)?.speeds) || [];
}

export function forgetSpeeds(): void {
  people.clear();
}

export function recordSensors(status: RoomStatus): void {
  const time = secondsOf(status.timeNs);
  for (const sensor of status.sensors) {
    const name = sensor.info?.name ?? "";
    recordDrift(name, time, sensor);
    // A sensor that is gone keeps its last figure; drawn on, it would look alive.
    if (sensor.residualMm === undefined || sensor.state !== SensorState.LIVE) continue;
    let series = residuals.get(name);
    if (!series) residuals.set(name, (series = new Series(SPAN)));
    series.push(time, sensor.residualMm);
  }
}

function recordDrift(name: string, time: number, { drift, state }: SensorStatus): void {
  if (!drift || state !== SensorState.LIVE) return;
  let series = drifts.get(name);
  if (!series) drifts.set(name, (series = { residual: new Series(DRIFT_SPAN), moved: new Series(DRIFT_SPAN) }));
  const since = time - (series.moved.latest?.time ?? -Infinity);
  if (since >= 0 && since < DRIFT_STEP) return;
  series.residual.push(time, drift.residualMm);
  series.moved.push(time, drift.movedMm);
}

export function driftOf(name: string): DriftSeries | undefined {
  return drifts.get(name);
}

export function residualOf(name: string): Series | undefined {
  return residuals.get(name);
}
