// A plan of the room as the page uses it. The server computes it; here it becomes words and something to draw.

import type { Interference, PlanArea, PlanLayer, PlanSensor, RoomPlan } from "../gen/posefuse/v1/room_pb";
import { rigidOf, type Rigid } from "./raw";

/** What is shown: where a whole person is seen, or one of the heights. */
export type LayerChoice = "whole" | "0" | "1" | "2";

export const LAYER_WORDS: Record<LayerChoice, string> = { whole: "Whole person", "0": "0.2 m", "1": "1.0 m", "2": "1.8 m" };

export const LAYERS: readonly LayerChoice[] = ["whole", "0", "1", "2"];

export function layerOf(plan: RoomPlan, choice: LayerChoice): PlanLayer | undefined {
  return choice === "whole" ? plan.whole : plan.layers[Number(choice)];
}

/** How many classes of "seen by so many": none, one, two, three or more. */
export const CLASSES = 4;

/** Share of the cells seen by exactly none, one, two, and by three or more sensors; sums up to 1. */
export function classShares(layer: PlanLayer): number[] {
  const counts = new Array<number>(CLASSES).fill(0);
  for (const count of layer.counts) counts[Math.min(count, CLASSES - 1)]! += 1;
  return counts.map((n) => n / Math.max(layer.counts.length, 1));
}

/** Square metres where at least so many sensors see. */
export function areaSeen(plan: RoomPlan, layer: PlanLayer, sensors: number): number {
  return layer.counts.filter((count) => count >= sensors).length * plan.cellM ** 2;
}

/** A sensor that somebody planned, as it is edited. Metres, room frame. */
export interface PlannedRow {
  name: string;
  model: string;
  at: [number, number, number];
  to: [number, number, number];
}

/** The height that sensors usually look at, metres: hips. */
const HIPS_M = 0.9;
const AHEAD_M = 2.5;

/** A sensor of a plan as one to edit: where it looks is the point of its axis at the height of hips, if it has one. */
export function rowOf(sensor: PlanSensor): PlannedRow | null {
  const m = rigidOf(sensor.roomFromSensor);
  if (!m) return null;
  const at: [number, number, number] = [m[3]!, m[7]!, m[11]!];
  const forward = [m[2]!, m[6]!, m[10]!];
  const reach = Math.abs(forward[2]!) > 1e-3 ? (HIPS_M - at[2]) / forward[2]! : -1;
  const ahead = reach > 0.5 && reach < 12 ? reach : AHEAD_M;
  return { name: sensor.name, model: sensor.model, at: rounded(at), to: rounded(at.map((v, i) => v + ahead * forward[i]!)) };
}

/** To a centimetre, as one measures a room. */
export function rounded(place: readonly number[]): [number, number, number] {
  return place.map((v) => Math.round(v * 100) / 100 || 0) as [number, number, number];
}

export interface PlanPair {
  a: string;
  b: string;
  strong: boolean;
  facing: boolean;
  /** The larger share of the two views. */
  share: number;
  advice: string;
}

export function pairOf(i: Interference): PlanPair {
  return { a: i.a, b: i.b, strong: i.severity === "strong", facing: i.facing, share: Math.max(i.shareOfA, i.shareOfB), advice: i.advice };
}

export type PlanKind = "there" | "planned" | "next";

/** A sensor of a plan, to be drawn. */
export interface PlanMark {
  name: string;
  kind: PlanKind;
  rigid: Rigid;
  /** Degrees. */
  fov: [number, number];
  /** Metres along the optical axis. */
  range: [number, number];
}

export function marksOf(plan: RoomPlan): PlanMark[] {
  const mark = (sensor: PlanSensor, kind: PlanKind): PlanMark[] => {
    const rigid = rigidOf(sensor.roomFromSensor);
    return rigid ? [{ name: sensor.name, kind, rigid, fov: [sensor.fovHorizontalDeg, sensor.fovVerticalDeg], range: [sensor.nearM, sensor.farM] }] : [];
  };
  const marks = plan.sensors.flatMap((sensor) => mark(sensor, sensor.planned ? "planned" : "there"));
  return plan.suggestion?.sensor ? [...marks, ...mark(plan.suggestion.sensor, "next")] : marks;
}

/** A rectangle of the floor. */
export type Area = Pick<PlanArea, "minX" | "maxX" | "minY" | "maxY">;

/** What the 3D view draws. */
export interface PlanShown {
  area: Area;
  cellM: number;
  columns: number;
  rows: number;
  /** Sensors that see each cell, along x first. */
  counts: Uint8Array;
  /** Where the cells are drawn, metres. */
  heightM: number;
  sensors: PlanMark[];
  pairs: PlanPair[];
}

/** The rows that are sensors to plan with; what somebody else wrote into the browser's memory is left out. */
export function readRows(stored: string | null): PlannedRow[] {
  try {
    const rows: unknown = JSON.parse(stored ?? "[]");
    const place = (v: unknown): v is [number, number, number] => Array.isArray(v) && v.length === 3 && v.every((n) => typeof n === "number" && Number.isFinite(n));
    return Array.isArray(rows) ? rows.filter((row) => typeof row?.name === "string" && typeof row?.model === "string" && place(row?.at) && place(row?.to)).slice(0, 32) : [];
  } catch {
    return [];
  }
}

/** A name that no sensor of the plan has. */
export function unusedName(taken: readonly string[]): string {
  for (let number = 1; ; number++) if (!taken.includes(`plan-${number}`)) return `plan-${number}`;
}
