// The calibrations that are kept: listing, comparing, restoring, saving and reading them.

import { signal } from "@preact/signals";
import type { SensorMove, StoredCalibration } from "../gen/posefuse/v1/room_pb";
import type { CalibrationFormat } from "../gen/posefuse/v1/room_pb";
import type { Calibration } from "../gen/posefuse/v1/types_pb";
import { refuseFile } from "../model/calibrations";
import { explain, room } from "../net/client";
import { notify } from "./store";

const PATIENCE = { timeoutMs: 10_000 };

/** Null until the server has answered. */
export const kept = signal<StoredCalibration[] | null>(null);
/** What went wrong with the list or with what was asked of one of them. */
export const keptTrouble = signal("");
/** Name of the one that is being restored or saved. */
export const keptBusy = signal("");

export interface Comparison {
  name: string;
  moves: SensorMove[];
}
export const comparison = signal<Comparison | null>(null);

/** A file that was chosen: what the server read in it, or why it could not. */
export type Import =
  | { kind: "none" }
  | { kind: "reading"; file: string }
  | { kind: "refused"; file: string; trouble: string }
  | { kind: "read"; file: string; text: string; calibration: Calibration; trouble: string };
export const imported = signal<Import>({ kind: "none" });

export function openCalibrations(): void {
  comparison.value = null;
  imported.value = { kind: "none" };
  keptTrouble.value = "";
  void refreshKept();
}

export async function refreshKept(): Promise<void> {
  try {
    kept.value = (await room.listCalibrations({}, PATIENCE)).calibrations;
  } catch (error) {
    keptTrouble.value = explain(error);
  }
}

/** Runs what is asked of one kept calibration, one at a time, and shows the server's words if it refuses. */
async function ask(name: string, what: () => Promise<void>): Promise<void> {
  if (keptBusy.value) return;
  keptBusy.value = name;
  keptTrouble.value = "";
  try {
    await what();
  } catch (error) {
    keptTrouble.value = explain(error);
  } finally {
    keptBusy.value = "";
  }
}

export function restore(name: string): Promise<void> {
  return ask(name, async () => {
    await room.restoreCalibration({ name }, PATIENCE);
    comparison.value = null;
    notify("info", `Calibration ${name} is in force.`);
    await refreshKept();
  });
}

/** How far each sensor stands from where the one in force has it; asked again for the same one, it is put away. */
export function compare(name: string): Promise<void> {
  if (comparison.value?.name === name) {
    comparison.value = null;
    return Promise.resolve();
  }
  return ask(name, async () => {
    const { moves } = await room.compareCalibrations({ before: name, after: "" }, PATIENCE);
    comparison.value = { name, moves };
  });
}

export function download(name: string, format: CalibrationFormat): Promise<void> {
  return ask(name, async () => {
    const file = await room.exportCalibration({ name, format }, PATIENCE);
    const url = URL.createObjectURL(new Blob([file.text], { type: "text/plain" }));
    const link = document.createElement("a");
    link.href = url;
    link.download = file.fileName || `${name}.txt`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  });
}

/** Has the server read a file, without putting anything in force. */
export async function readFile(file: File): Promise<void> {
  const refused = refuseFile(file);
  if (refused) {
    imported.value = { kind: "refused", file: file.name, trouble: refused };
    return;
  }
  imported.value = { kind: "reading", file: file.name };
  try {
    const text = await file.text();
    const calibration = await room.importCalibration({ text, dryRun: true }, PATIENCE);
    imported.value = { kind: "read", file: file.name, text, calibration, trouble: "" };
  } catch (error) {
    imported.value = { kind: "refused", file: file.name, trouble: explain(error) };
  }
}

/** Puts the file that was read in force. */
export async function acceptImport(): Promise<void> {
  const chosen = imported.value;
  if (chosen.kind !== "read") return;
  try {
    await room.importCalibration({ text: chosen.text }, PATIENCE);
    imported.value = { kind: "none" };
    notify("info", `The calibration from ${chosen.file} is in force.`);
    await refreshKept();
  } catch (error) {
    imported.value = { ...chosen, trouble: explain(error) };
  }
}
