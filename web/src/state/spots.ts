// Where each sensor sees people, on the floor of its own view: shown while somebody walks for a calibration, since there
// may be no room frame yet. One more stream, at a low rate, and only then.

import { computed, effect, signal } from "@preact/signals";
import type { Observation } from "../gen/posefuse/v1/types_pb";
import { room } from "../net/client";
import { keepOpen } from "../net/keep";
import { calibrating, connection, status } from "./store";

/** Right and ahead of the sensor, metres. */
export type Spot = readonly [number, number];

const RATE_HZ = 8;
const PUBLISH_MS = 125;
const STALE_MS = 700;

export const spots = signal<ReadonlyMap<string, readonly Spot[]>>(new Map());

const walking = computed(() => calibrating.value.kind === "running" && connection.value.kind === "online");

export function startSpots(): void {
  effect(() => {
    if (!walking.value) return;
    const latest = new Map<number, { at: number; spots: Spot[] }>();
    const kept = keepOpen<Observation>({
      open: (signal) => room.watchSensors({ maxRateHz: RATE_HZ }, { signal }),
      onMessage: (message) => latest.set(message.sensor, { at: performance.now(), spots: spotsOf(message) }),
    });
    const timer = setInterval(() => (spots.value = named(latest)), PUBLISH_MS);
    return () => {
      clearInterval(timer);
      kept.stop();
      spots.value = new Map();
    };
  });
}

/** The pelvis of each body that has one. */
export function spotsOf(observation: Observation): Spot[] {
  return observation.bodies.flatMap((body) => {
    const [x, , z] = body.positions;
    return (body.confidences[0] ?? 0) > 0 && x !== undefined && z !== undefined ? [[x, z] as const] : [];
  });
}

function named(latest: Map<number, { at: number; spots: Spot[] }>): Map<string, readonly Spot[]> {
  const fresh = performance.now() - STALE_MS;
  const result = new Map<string, readonly Spot[]>();
  for (const sensor of status.peek()?.sensors ?? []) {
    const seen = sensor.info && latest.get(sensor.info.id);
    if (seen && seen.at >= fresh) result.set(sensor.info!.name, seen.spots);
  }
  return result;
}
