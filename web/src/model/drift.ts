// Whether a sensor still stands where its calibration says.

import type { Drift, SensorStatus } from "../gen/posefuse/v1/room_pb";
import { sentence } from "./coverage";
import { fixed } from "./format";

export interface Alarm {
  sensor: string;
  /** Who moved and by how much, a sentence without its full stop. */
  what: string;
  /** What to do. */
  remedy: string;
  muted: boolean;
}

/** The sensors that have moved, in the order given. */
export function alarmsOf(sensors: readonly SensorStatus[]): Alarm[] {
  return sensors.flatMap((s) => {
    if (!s.drift?.alarm) return [];
    const sensor = s.info?.name ?? "";
    // The server's words know more: of two sensors nobody can tell which one moved.
    const told = /^[^:]*\bhas moved\b[^:]*/.exec(s.trouble)?.[0];
    const unsure = told?.startsWith("either") ?? false;
    return [{
      sensor,
      what: told ? sentence(told) : `Sensor ${sensor} has moved by about ${amountOf(s.drift)}`,
      remedy: unsure
        ? "Find out which, walk about for 20 s in view of both, then recalibrate that one."
        : "Walk about for 20 s in its view, then recalibrate it.",
      muted: s.muted,
    }];
  });
}

/** Shifts under a centimetre are told in whole millimetres, turns in tenths of a degree. */
export function amountOf(drift: Drift): string {
  return `${fixed(drift.movedMm, 0, "mm")} and ${fixed(drift.movedDeg, 1)}°`;
}

/** The same with its uncertainty, and what it was taken from. */
export function explainDrift(drift: Drift | undefined): string {
  if (!drift) return "Nothing can be said yet about whether it has moved since it was calibrated";
  const pm = (value: number, sigma: number, digits: number, unit: string) => `${fixed(value, digits)} ± ${fixed(sigma, digits)}${unit}`;
  return (
    `Since it was calibrated it seems to have moved by ${pm(drift.movedMm, drift.movedSigmaMm, 0, "\u00a0mm")} and ` +
    `${pm(drift.movedDeg, drift.movedSigmaDeg, 1, "°")}; residual ${fixed(drift.residualMm, 0, "mm")}, usually ${fixed(drift.usualMm, 0, "mm")}`
  );
}
