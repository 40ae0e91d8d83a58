// What is done to single sensors: leaving one out of fusing, and finding the place of one anew.

import { effect, signal } from "@preact/signals";
import type { CalibrateResult } from "../gen/posefuse/v1/room_pb";
import { harm } from "../model/contribution";
import { explain, room } from "../net/client";
import { dialog, notify, sensors, status } from "./store";

/** Sensors whose muting the server has not answered yet. */
export const muting = signal<ReadonlySet<string>>(new Set());

export async function mute(sensor: string, muted: boolean): Promise<void> {
  if (muting.value.has(sensor)) return;
  muting.value = new Set(muting.value).add(sensor);
  try {
    await room.muteSensor({ sensor, muted }, { timeoutMs: 10_000 });
    const now = status.value;
    if (now) status.value = { ...now, sensors: now.sensors.map((s) => (s.info?.name === sensor ? { ...s, muted } : s)) };
  } catch (error) {
    notify("error", explain(error));
  } finally {
    muting.value = new Set([...muting.value].filter((name) => name !== sensor));
  }
}

export type Recalibration =
  | { kind: "none" }
  | { kind: "busy"; sensor: string }
  | { kind: "done"; sensor: string; result: CalibrateResult }
  | { kind: "failed"; sensor: string; trouble: string };

export const recalibration = signal<Recalibration>({ kind: "none" });

/** Finds one sensor's place from what all saw of late; the server puts it in force unless it fails. */
export async function recalibrate(sensor: string): Promise<void> {
  if (recalibration.value.kind === "busy") return;
  recalibration.value = { kind: "busy", sensor };
  try {
    const result = await room.recalibrateSensor({ sensor }, { timeoutMs: 120_000 });
    recalibration.value = { kind: "done", sensor, result };
  } catch (error) {
    recalibration.value = { kind: "failed", sensor, trouble: explain(error) };
  }
  if (dialog.value === "none" || dialog.value === "weights") dialog.value = "recalibrated";
  else notify("info", `The recalibration of ${sensor} has ended.`);
}

/** What is wrong with each sensor's part in the fused people, in words; sensors that do well are not in it. */
export const harms = signal<ReadonlyMap<string, string>>(new Map());

export function startHarms(): void {
  effect(() => {
    const found = new Map<string, string>();
    for (const sensor of sensors.value) {
      const name = sensor.info?.name ?? "";
      const others = sensors.value.flatMap((s) => (s !== sensor && !s.muted && s.contribution?.residualMm !== undefined ? [s.contribution.residualMm] : []));
      const words = harm(sensor.contribution, others, harms.peek().has(name));
      if (words) found.set(name, words);
    }
    const before = harms.peek();
    if (found.size !== before.size || [...found].some(([name, words]) => before.get(name) !== words)) harms.value = found;
  });
}
