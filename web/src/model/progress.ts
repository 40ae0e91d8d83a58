// How far a calibration walk has come, as the operator's guide. The server alone gives the verdict.

import type { SensorProgress } from "../gen/posefuse/v1/room_pb";

export type Grade = "few" | "fair" | "good";

function grade(n: number, fair: number, good: number): Grade {
  return n >= good ? "good" : n >= fair ? "fair" : "few";
}

/** Floor cells of 0.5 m: 6 are a step or two each way, 14 the walk of half a small room. */
export function coverage(cells: number): Grade {
  return grade(cells, 6, 14);
}

/** The sensor that shares most frames with this one: one strong link ties it to the others. */
export function linkOf(progress: SensorProgress): { partner: string; frames: number; grade: Grade } {
  let partner = "";
  let frames = 0;
  for (const [name, shared] of Object.entries(progress.shared)) {
    if (Number(shared) > frames) {
      partner = name;
      frames = Number(shared);
    }
  }
  return { partner, frames, grade: grade(frames, 60, 200) };
}
