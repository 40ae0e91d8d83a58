// Raw skeletons of single sensors, put into the room by `room_from_sensor`.

import type { Observation, Pose } from "../gen/posefuse/v1/types_pb";
import { JOINT_COUNT } from "./joints";

export interface RawBody {
  /** The sensor's colour, 0 to 6. */
  colour: number;
  /** 75 numbers, metres, room frame; NaN where a joint is missing. */
  positions: Float32Array;
}

/** A rigid motion as the columns of its rotation matrix and its translation, row-major 3x4. */
export type Rigid = Float64Array;

/** Null when the pose is absent, not finite, or its quaternion has no direction. */
export function rigidOf(pose: Pose | undefined): Rigid | null {
  const t = pose?.translation;
  const q = pose?.rotation;
  if (!t || !q) return null;
  const norm = Math.hypot(q.x, q.y, q.z, q.w);
  if (!(norm > 1e-6) || !Number.isFinite(norm + t.x + t.y + t.z)) return null;
  const x = q.x / norm;
  const y = q.y / norm;
  const z = q.z / norm;
  const w = q.w / norm;
  return new Float64Array([
    1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), t.x,
    2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), t.y,
    2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), t.z,
  ]);
}

/** The bodies of an observation in the room; a body of another shape than 25 joints is left out. */
export function placeBodies(observation: Observation, roomFromSensor: Rigid, colour: number): RawBody[] {
  const placed: RawBody[] = [];
  for (const body of observation.bodies) {
    if (body.positions.length !== 3 * JOINT_COUNT || body.confidences.length !== JOINT_COUNT) continue;
    const positions = new Float32Array(3 * JOINT_COUNT).fill(NaN);
    for (let i = 0; i < JOINT_COUNT; i++) {
      if (body.confidences[i]! > 0) transform(roomFromSensor, body.positions, positions, 3 * i);
    }
    placed.push({ colour, positions });
  }
  return placed;
}

function transform(m: Rigid, from: ArrayLike<number>, to: Float32Array, at: number): void {
  const x = from[at]!;
  const y = from[at + 1]!;
  const z = from[at + 2]!;
  for (let row = 0; row < 3; row++) {
    to[at + row] = m[4 * row]! * x + m[4 * row + 1]! * y + m[4 * row + 2]! * z + m[4 * row + 3]!;
  }
}
