// Values over time for the plots, and joint speeds from positions. Times in seconds, ascending.

export interface Point {
  time: number;
  value: number;
}

/** The last `span` seconds of a value. A time that steps back (another take, a seek) starts it anew. */
export class Series {
  points: Point[] = [];

  constructor(readonly span: number) {}

  push(time: number, value: number): void {
    if (!Number.isFinite(time) || !Number.isFinite(value)) return;
    const last = this.points[this.points.length - 1];
    if (last && time < last.time) this.points = [];
    if (last && time === last.time) return;
    this.points.push({ time, value });
    let old = 0;
    while (this.points[old]!.time < time - this.span) old += 1;
    if (old > 0) this.points.splice(0, old);
  }

  get latest(): Point | undefined {
    return this.points[this.points.length - 1];
  }

  /** The value at the sample nearest to `time`, if one lies within `within` seconds. */
  near(time: number, within: number): Point | undefined {
    let best: Point | undefined;
    for (const point of this.points) {
      if (!best || Math.abs(point.time - time) < Math.abs(best.time - time)) best = point;
    }
    return best && Math.abs(best.time - time) <= within ? best : undefined;
  }
}

interface Sample {
  time: number;
  x: number;
  y: number;
  z: number;
}

/** How much of the past one speed is taken from, and the largest gap it may hold, seconds. */
const SPEED_WINDOW = 0.12;
const SPEED_GAP = 0.1;

/** Speed of a point from the straight line that fits its last 0.12 s best: a plain difference would show jitter. */
export class SpeedMeter {
  private samples: Sample[] = [];

  /** Metres per second, or null until three samples without a gap are there. */
  push(time: number, x: number, y: number, z: number): number | null {
    const last = this.samples[this.samples.length - 1];
    if (last && (time <= last.time || time - last.time > SPEED_GAP)) this.samples = [];
    this.samples.push({ time, x, y, z });
    while (this.samples[0]!.time < time - SPEED_WINDOW) this.samples.shift();
    return this.samples.length < 3 ? null : slope(this.samples);
  }
}

function slope(samples: Sample[]): number {
  const n = samples.length;
  const mean = { time: 0, x: 0, y: 0, z: 0 };
  for (const s of samples) {
    mean.time += s.time / n;
    mean.x += s.x / n;
    mean.y += s.y / n;
    mean.z += s.z / n;
  }
  let tt = 0;
  const v = [0, 0, 0];
  for (const s of samples) {
    const dt = s.time - mean.time;
    tt += dt * dt;
    v[0]! += dt * (s.x - mean.x);
    v[1]! += dt * (s.y - mean.y);
    v[2]! += dt * (s.z - mean.z);
  }
  return Math.hypot(v[0]!, v[1]!, v[2]!) / tt;
}

/** A round top for a value axis, at least `floor`; half of it is a short figure too. */
export function axisTop(largest: number, floor: number): number {
  const wanted = Math.max(largest, floor);
  const power = 10 ** Math.floor(Math.log10(wanted));
  for (const step of [1, 1.5, 2, 3, 4, 5, 6, 8, 10]) if (step * power >= wanted * (1 - 1e-9)) return step * power;
  return 10 * power;
}
