// Planning the room: what was planned by hand, what the server makes of it, and what of that is shown.

import { computed, effect, signal, untracked } from "@preact/signals";
import type { RoomPlan } from "../gen/posefuse/v1/room_pb";
import { layerOf, marksOf, pairOf, readRows, rounded, rowOf, unusedName, type Area, type LayerChoice, type PlannedRow, type PlanShown } from "../model/plan";
import { explain, room } from "../net/client";
import { keep, kept } from "./prefs";
import { calibratedSensors, connection, sensors, status } from "./store";

const ROWS = "posefuse.plan";
/** Editing asks anew only after a pause. */
const PAUSE_MS = 150;
/** Most sensors that the server takes in a plan. */
export const MAX_PLANNED = 32;

export const planOpen = signal(false);
export const planLayer = signal<LayerChoice>("whole");
/** Null: about where the sensors look. */
export const planArea = signal<Area | null>(null);
export const planRows = signal<PlannedRow[]>(readRows(kept(ROWS)));
/** Whether the room's own sensors count. */
export const planRoom = signal(true);
export const planModel = signal("Kinect v2");

export const plan = signal<RoomPlan | null>(null);
export const planTrouble = signal("");
export const planBusy = signal(false);

export const planShown = computed<PlanShown | null>(() => {
  const found = plan.value;
  if (!planOpen.value || !found?.area) return null;
  const layer = layerOf(found, planLayer.value);
  if (!layer || layer.counts.length !== found.columns * found.rows) return null;
  const { area, cellM, columns, rows } = found;
  const heightM = planLayer.value === "whole" ? 0 : layer.heightM;
  return { area, cellM, columns, rows, counts: layer.counts, heightM, sensors: marksOf(found), pairs: found.interferences.map(pairOf) };
});

/** Changes whenever the room's own sensors stand elsewhere or see something else. */
const roomKey = computed(() =>
  JSON.stringify([status.value?.calibration?.created, sensors.value.map((s) => [s.info?.name, s.info?.model, s.calibrated, s.fovHorizontalDeg, s.farM])]),
);

function request() {
  const vector = ([x, y, z]: PlannedRow["at"]) => ({ x, y, z });
  return {
    planned: planRows.value.map((row) => ({ name: row.name, model: row.model, position: vector(row.at), looksAt: vector(row.to) })),
    plannedOnly: !planRoom.value,
    area: planArea.value ?? undefined,
    suggestModel: planModel.value,
  };
}

let asking: AbortController | null = null;

/** Asks anew; an earlier question that is not answered yet is called off, so that the server need not answer it. */
async function ask(place = 0): Promise<RoomPlan | null> {
  asking?.abort();
  const mine = (asking = new AbortController());
  planBusy.value = true;
  try {
    const found = await room.planRoom({ ...request(), place }, { timeoutMs: 30_000, signal: mine.signal });
    if (mine !== asking) return null;
    plan.value = found;
    planTrouble.value = "";
    return found;
  } catch (error) {
    if (mine === asking) planTrouble.value = explain(error);
    return null;
  } finally {
    if (mine === asking) planBusy.value = false;
  }
}

export function startPlan(): void {
  effect(() => keep(ROWS, JSON.stringify(planRows.value)));
  effect(() => {
    if (!planOpen.value || connection.value.kind !== "online") return;
    request();
    void roomKey.value;
    const timer = setTimeout(() => untracked(() => void ask()), PAUSE_MS);
    return () => clearTimeout(timer);
  });
}

function namesTaken(): string[] {
  return [...planRows.value, ...(plan.value?.sensors ?? [])].map((s) => s.name);
}

/** Adds the sensor that the plan suggests. */
export function addSuggested(): void {
  const row = plan.value?.suggestion?.sensor && rowOf(plan.value.suggestion.sensor);
  const to = plan.value?.suggestion?.looksAt;
  if (!row || planRows.value.length >= MAX_PLANNED) return;
  keepArea();
  planRows.value = [...planRows.value, { ...row, to: to ? rounded([to.x, to.y, to.z]) : row.to, name: unusedName(namesTaken()) }];
}

/** An area that moved with each sensor that is planned for it would be none to plan for. */
function keepArea(): void {
  const area = plan.value?.area;
  if (area && !planArea.value) planArea.value = { minX: area.minX, maxX: area.maxX, minY: area.minY, maxY: area.maxY };
}

/** Adds a sensor by hand: beside the area, looking at its middle. */
export function addByHand(): void {
  const area = plan.value?.area;
  const middle: [number, number] = area ? [(area.minX + area.maxX) / 2, (area.minY + area.maxY) / 2] : [0, 0];
  const row: PlannedRow = { name: unusedName(namesTaken()), model: planModel.value, at: rounded([area?.minX ?? -2, middle[1], 1.4]), to: rounded([...middle, 0.9]) };
  keepArea();
  if (planRows.value.length < MAX_PLANNED) planRows.value = [...planRows.value, row];
}

/** Places so many sensors one after the other, each where it is of most use. */
export async function place(count: number): Promise<void> {
  const found = await ask(count);
  if (!found) return;
  keepArea();
  const known = new Set(planRows.value.map((row) => row.name));
  const placed = found.sensors.filter((s) => s.planned && !known.has(s.name)).flatMap((s) => rowOf(s) ?? []);
  if (placed.length > 0) planRows.value = [...planRows.value, ...placed].slice(0, MAX_PLANNED);
}

export function changeRow(name: string, change: Partial<PlannedRow>): void {
  planRows.value = planRows.value.map((row) => (row.name === name ? { ...row, ...change } : row));
}

export function removeRow(name: string): void {
  planRows.value = planRows.value.filter((row) => row.name !== name);
}

/** Whether the room has sensors whose place is known. */
export const roomHasSensors = computed(() => calibratedSensors.value > 0);
