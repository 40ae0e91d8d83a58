// How far a calibration walk has come, as the operator's guide. The server alone gives the verdict.

import type { SensorProgress } from "../gen/posefuse/v1/room_pb";

export type Grade = "few" | "fair" | "good";

/** What a walk needs of each sensor: floor cells of 0.5 m, and seconds of view shared with one other sensor. */
const WANTED = { cells: 8, seconds: 15 };

function grade(n: number, wanted: number): Grade {
  return n >= wanted ? "good" : n >= wanted / 2 ? "fair" : "few";
}

export function coverage(cells: number): Grade {
  return grade(cells, WANTED.cells);
}

export interface Link {
  partner: string;
  seconds: number;
  grade: Grade;
}

/** The sensor that shares most with this one, at `rate` frames per second: one strong link ties it to the others. */
export function linkOf(progress: SensorProgress, rate: number): Link {
  let partner = "";
  let frames = 0;
  for (const [name, shared] of Object.entries(progress.shared)) {
    if (Number(shared) > frames) {
      partner = name;
      frames = Number(shared);
    }
  }
  const seconds = frames / (rate > 1 ? rate : 30);
  return { partner, seconds, grade: grade(seconds, WANTED.seconds) };
}
