// Kept calibrations: how they are told apart, compared and saved.

import { CalibrationFormat, type SensorMove, type StoredCalibration } from "../gen/posefuse/v1/room_pb";
import { fixed } from "./format";

export const FORMATS: readonly { format: CalibrationFormat; label: string; title: string }[] = [
  { format: CalibrationFormat.TOML, label: "TOML", title: "Posefuse's own, with everything that is known" },
  { format: CalibrationFormat.JSON, label: "JSON", title: "The same as JSON" },
  { format: CalibrationFormat.TF2_YAML, label: "ROS tf2", title: "Static transforms for ROS, YAML" },
  { format: CalibrationFormat.OPENCV_YAML, label: "OpenCV", title: "OpenCV file storage, YAML" },
];

/** A calibration's file is some kilobytes; what is larger was chosen by mistake. */
export const LARGEST_FILE = 4_000_000;

/** Why a file cannot be read at all; empty: it can be shown to the server. */
export function refuseFile(file: { name: string; size: number }): string {
  if (file.size === 0) return `${file.name} is empty.`;
  if (file.size > LARGEST_FILE) return `${file.name} has ${Math.round(file.size / 1e6)} MB: a calibration is a text of some kilobytes.`;
  return "";
}

/** A move from a kept calibration to the one in force as three figures, and why there are none. */
export function moveRow(move: SensorMove): { mm: string; deg: string; ms: string; note: string } {
  const notes: Record<string, string> = { before: "not in this one", after: "not in the one in force" };
  const note = notes[move.missingIn] ?? move.missingIn;
  return { mm: fixed(move.movedMm, 1), deg: fixed(move.movedDeg, 2), ms: fixed(move.movedMs, 1), note };
}

/** The name of the one in force, empty where none of them is. */
export function inForceName(list: readonly StoredCalibration[]): string {
  return list.find((c) => c.inForce)?.name ?? "";
}

/** Sensor names of a kept calibration, sorted as on the cards. */
export function sensorNames(stored: StoredCalibration): string[] {
  const names = (stored.calibration?.sensors ?? []).map((s) => s.sensor);
  return names.sort((a, b) => a.localeCompare(b, "en", { numeric: true }));
}
