// How much of each sensor's view a calibration walk has covered. A top view in the sensor's own axes: right, and ahead,
// metres. The server says when it is enough; here it only becomes something to draw.

import type { SensorProgress } from "../gen/posefuse/v1/room_pb";

export type Grade = "few" | "fair" | "enough";

export const GRADE_WORDS: Record<Grade, string> = { few: "needs more", fair: "getting there", enough: "enough" };

export function gradeOf(share: number): Grade {
  return share >= 1 ? "enough" : share >= 0.5 ? "fair" : "few";
}

/** Edge of a floor cell, metres. */
export const CELL_M = 0.5;

export interface Cell {
  /** Whole cells; cell 0 begins at the sensor. */
  right: number;
  ahead: number;
}

/** Pairs of numbers as cells, each once; half a pair at the end is left out. */
export function cellsOf(covered: readonly number[]): Cell[] {
  const cells = new Map<string, Cell>();
  for (let i = 0; i + 1 < covered.length; i += 2) {
    const cell = { right: covered[i]!, ahead: covered[i + 1]! };
    cells.set(`${cell.right} ${cell.ahead}`, cell);
  }
  return [...cells.values()];
}

/** What a map shows, metres: from the sensor on ahead, and as far to each side. */
export interface Extent {
  ahead: number;
  side: number;
}

/** A Kinect v2 sees 4.5 m far and, there, 3.2 m to each side. */
const USUAL: Extent = { ahead: 4.5, side: 3.25 };
const LARGEST_M = 12;

/** Room for all cells, growing by whole metres so that the map does not creep. */
export function extentOf(cells: readonly Cell[]): Extent {
  const extent = { ...USUAL };
  for (const { right, ahead } of cells) {
    const far = (ahead + 1) * CELL_M;
    const wide = Math.max(-right, right + 1) * CELL_M;
    if (far > extent.ahead) extent.ahead = Math.ceil(far);
    if (wide > extent.side) extent.side = Math.ceil(wide);
  }
  return { ahead: Math.min(extent.ahead, LARGEST_M), side: Math.min(extent.side, LARGEST_M) };
}

/** The corners of a sensor's view from above, metres (right, ahead), cut off at the map's edges; empty where the angle is unknown. */
export function coneOf(fovHorizontalDeg: number, { ahead, side }: Extent): [number, number][] {
  if (!(fovHorizontalDeg > 0)) return [];
  const slope = Math.tan((Math.min(fovHorizontalDeg, 170) * Math.PI) / 360);
  if (slope * ahead <= side) return [[0, 0], [-slope * ahead, ahead], [slope * ahead, ahead]];
  const bend = side / slope;
  return [[0, 0], [-side, bend], [-side, ahead], [side, ahead], [side, bend]];
}

export interface Link {
  partner: string;
  frames: number;
}

/** The sensor that shares most with this one: one strong link ties it to the others. Null: none shares anything. */
export function linkOf(progress: SensorProgress): Link | null {
  let best: Link | null = null;
  for (const [partner, shared] of Object.entries(progress.shared)) {
    if (Number(shared) > (best?.frames ?? 0)) best = { partner, frames: Number(shared) };
  }
  return best;
}

/** What the person in the room is told, in large letters. `names` are sensors', which are written as they are. */
export function instruction(progress: { hint: string; solving: boolean; share: number } | null, names: readonly string[] = []): string {
  if (!progress) return "Waiting for the first frames …";
  if (progress.solving) return "Thank you. Solving …";
  return sentence(progress.hint, names) || (progress.share >= 1 ? "Enough seen." : "Walk about, turn around, reach.");
}

/**
 * The server's words begin small, as parts of a sentence do, and set names in backticks, as in a terminal; on their own
 * they begin large, unless with a name, and names stand as they are.
 */
export function sentence(text: string, names: readonly string[] = []): string {
  const words = text.replaceAll("`", "");
  if (names.some((name) => name !== "" && words.startsWith(name))) return words;
  return words.charAt(0).toUpperCase() + words.slice(1);
}
