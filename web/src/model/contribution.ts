// A sensor's part in the fused people: its weight, what of it was ignored, and whether it does more harm than good.

import type { Contribution } from "../gen/posefuse/v1/room_pb";
import { JOINT_COUNT } from "./joints";

export type Quantity = "weight" | "rejected" | "residual";

export const QUANTITIES: Record<Quantity, { label: string; unit: string; title: string }> = {
  weight: { label: "Weight", unit: "%", title: "Share of the weight that the sensor had in the joint" },
  rejected: { label: "Ignored", unit: "%", title: "Share of its measurements that fusing all but ignored, because they contradict the others" },
  residual: { label: "Residual", unit: "mm", title: "Median distance to the fusion of the others" },
};

/** Null: not known. Shares from 0 to 1, residuals in millimetres. */
export type JointPart = Record<Quantity, number | null>;

/** 25 entries in canonical order; all unknown where the server says nothing or sends arrays of another length. */
export function jointParts(contribution: Contribution | undefined): JointPart[] {
  const take = (values: readonly number[] | undefined, i: number) => {
    const value = values?.length === JOINT_COUNT ? values[i]! : NaN;
    return value >= 0 ? value : null;
  };
  return Array.from({ length: JOINT_COUNT }, (_, i) => ({
    weight: take(contribution?.jointWeights, i),
    rejected: take(contribution?.jointRejectedShares, i),
    residual: take(contribution?.jointResidualsMm, i),
  }));
}

/** A figure of the table: per cent or millimetres, no unit. */
export function figure(quantity: Quantity, value: number | null): string {
  if (value === null) return "–";
  return String(Math.round(quantity === "residual" ? value : 100 * value));
}

/** Where a value stops being unremarkable, and where it is bad. A weight is neither good nor bad. */
const LIMITS: Record<"rejected" | "residual", [number, number]> = { rejected: [0.1, 0.25], residual: [50, 100] };

export type Heat = "none" | "calm" | "warm" | "hot";

export function heatOf(quantity: Quantity, value: number | null): Heat {
  if (value === null) return "none";
  if (quantity === "weight") return "calm";
  const [warm, hot] = LIMITS[quantity];
  return value >= hot ? "hot" : value >= warm ? "warm" : "calm";
}

/** How full a bar is, 0 to 1. */
export function fill(quantity: Quantity, value: number | null): number {
  if (value === null) return 0;
  return Math.min(quantity === "residual" ? value / 150 : value, 1);
}

/** From which share of ignored measurements on a sensor hurts, and below which it no longer does. */
const REJECTED = { on: 0.25, off: 0.18 };
/** The same for its residual, as a multiple of the other sensors' median; less than 60 mm is never called harm. */
const RESIDUAL = { on: 2.5, off: 2, leastMm: 60 };

/**
 * What is wrong with a sensor's part, in words; empty when nothing is. `othersMm` are the residuals of the sensors it
 * is compared with, `before` says whether it was so a moment ago: what stands at a limit must not flicker.
 */
export function harm(contribution: Contribution | undefined, othersMm: readonly number[], before: boolean): string {
  if (!contribution) return "";
  const parts: string[] = [];
  const rejected = contribution.rejectedShare;
  if (rejected >= (before ? REJECTED.off : REJECTED.on)) {
    parts.push(`${Math.round(100 * rejected)} % contradicts the others and is ignored`);
  }
  const own = contribution.residualMm;
  const usual = median(othersMm);
  if (own !== undefined && usual !== null && own >= Math.max(RESIDUAL.leastMm, (before ? RESIDUAL.off : RESIDUAL.on) * usual)) {
    parts.push(`${Math.round(own)} mm off, others ${Math.round(usual)} mm`);
  }
  return parts.join("; ");
}

export function median(values: readonly number[]): number | null {
  if (values.length === 0) return null;
  const sorted = [...values].sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle]! : (sorted[middle - 1]! + sorted[middle]!) / 2;
}
