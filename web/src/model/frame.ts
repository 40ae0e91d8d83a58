// Fused frames as the page uses them: decoded once, checked once. Metres, room frame (x forward, y left, z up).

import { Provenance, type RoomFrame, type Track } from "../gen/posefuse/v1/types_pb";
import { ellipsoid, type Ellipsoid } from "./covariance";
import { JOINT_COUNT } from "./joints";

/** Where the knowledge of a joint comes from; `null` where the joint is missing. */
export type Source = "measured" | "inferred" | "repaired";

export interface Joint {
  x: number;
  y: number;
  z: number;
  source: Source;
  /** How well the position is known, where the server says so. */
  spread: Ellipsoid | null;
}

export interface Person {
  /** The server's track id, decimal. */
  id: string;
  /** 25 joints in canonical order; a missing one is null. */
  joints: (Joint | null)[];
  /** Ids of the sensors that contributed, ascending. */
  sensors: number[];
}

export interface Frame {
  /** Seconds, the server's clock; only differences mean something. */
  time: number;
  people: Person[];
  /** Tracks whose arrays did not have the shape of 25 joints. */
  malformed: number;
}

const NS_PER_S = 1e9;

export function secondsOf(ns: bigint): number {
  return Number(ns) / NS_PER_S;
}

/** The indices of the bits that are set, ascending. */
export function bitsOf(set: bigint): number[] {
  const bits: number[] = [];
  for (let bit = 0; bit < 64; bit++) if ((set >> BigInt(bit)) & 1n) bits.push(bit);
  return bits;
}

export function decodeFrame(frame: RoomFrame): Frame {
  const people: Person[] = [];
  let malformed = 0;
  for (const track of frame.tracks) {
    const person = decodeTrack(track);
    if (person) people.push(person);
    else malformed += 1;
  }
  people.sort((a, b) => (BigInt(a.id) < BigInt(b.id) ? -1 : 1));
  return { time: secondsOf(frame.timeNs), people, malformed };
}

/** Null when an array is not as long as 25 joints need; covariances may be absent altogether. */
export function decodeTrack(track: Track): Person | null {
  if (track.positions.length !== 3 * JOINT_COUNT || track.provenances.length !== JOINT_COUNT) return null;
  const hasSpread = track.covariances.length === 6 * JOINT_COUNT;
  if (!hasSpread && track.covariances.length !== 0) return null;
  const joints: (Joint | null)[] = [];
  for (let i = 0; i < JOINT_COUNT; i++) {
    const source = sourceOf(track.provenances[i]!);
    const x = track.positions[3 * i]!;
    const y = track.positions[3 * i + 1]!;
    const z = track.positions[3 * i + 2]!;
    const known = source !== null && Number.isFinite(x) && Number.isFinite(y) && Number.isFinite(z);
    joints.push(known ? { x, y, z, source, spread: hasSpread ? ellipsoid(track.covariances, 6 * i) : null } : null);
  }
  return { id: track.id.toString(), joints, sensors: bitsOf(track.sensors) };
}

function sourceOf(provenance: Provenance): Source | null {
  switch (provenance) {
    case Provenance.MEASURED:
      return "measured";
    case Provenance.PREDICTED:
      return "inferred";
    case Provenance.REPAIRED:
      return "repaired";
    default:
      return null;
  }
}

/** A bone is known no better than its worse end. */
export function worse(a: Source, b: Source): Source {
  const rank = { measured: 0, inferred: 1, repaired: 2 };
  return rank[a] >= rank[b] ? a : b;
}
