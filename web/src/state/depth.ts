// Depth previews: whose are open, the stream they come on, and the newest image of each.
//
// All come on one stream, since a browser holds few connections to one server. A preview that is scrolled out of view or
// in a hidden tab is not streamed.

import { computed, signal } from "@preact/signals";
import type { DepthPreview } from "../gen/posefuse/v1/types_pb";
import { decodeDepth, Rate, type DepthImage } from "../model/depth";
import { Feed, sensors } from "./store";

/** Sensors whose preview is open. */
export const depthOpen = signal<ReadonlySet<string>>(new Set());
/** Sensors whose preview is enlarged in the dialog. */
export const depthLarge = signal<string | null>(null);
/** How many places on the page show a sensor's preview now. */
const shown = signal<ReadonlyMap<string, number>>(new Map());

/** The sensors to stream, in order; changes only when they change. */
export const depthWanted = computed(() =>
  sensors.value
    .filter((s) => s.depthPreview && (shown.value.get(s.info?.name ?? "") ?? 0) > 0)
    .map((s) => s.info?.name ?? "")
    .join("\n"),
);

export interface Depth {
  image: DepthImage;
  /** Images a second, lately. */
  rate: number;
}

const feeds = new Map<string, Feed<Depth | null>>();
const rates = new Map<string, Rate>();

export function depthOf(sensor: string): Feed<Depth | null> {
  let feed = feeds.get(sensor);
  if (!feed) feeds.set(sensor, (feed = new Feed<Depth | null>(null)));
  return feed;
}

/** All previews that are on the page, for the 3D view. */
export const depthClouds = new Feed<ReadonlyMap<string, DepthImage>>(new Map());

export function toggleDepth(sensor: string): void {
  const open = new Set(depthOpen.value);
  if (!open.delete(sensor)) open.add(sensor);
  depthOpen.value = open;
}

/** Says that a preview is on the page; returns what to call when it is no more. */
export function showDepth(sensor: string): () => void {
  const change = (by: number) => {
    const counts = new Map(shown.peek());
    counts.set(sensor, (counts.get(sensor) ?? 0) + by);
    shown.value = counts;
  };
  change(1);
  return () => change(-1);
}

export function takeDepth(message: DepthPreview): void {
  // One that was under way when its preview was closed.
  if (!depthWanted.peek().split("\n").includes(message.sensor)) return;
  const image = decodeDepth(message);
  if (!image) return;
  let rate = rates.get(message.sensor);
  if (!rate) rates.set(message.sensor, (rate = new Rate()));
  const now = performance.now();
  rate.add(now);
  depthOf(message.sensor).set({ image, rate: rate.perSecond(now) });
  depthClouds.set(new Map(depthClouds.value).set(message.sensor, image));
}

/** Drops the images of sensors that are not streamed. */
export function forgetDepth(keep: readonly string[]): void {
  for (const [sensor, feed] of feeds) {
    if (keep.includes(sensor)) continue;
    rates.delete(sensor);
    if (feed.value) feed.set(null);
  }
  const kept = [...depthClouds.value].filter(([sensor]) => keep.includes(sensor));
  if (kept.length !== depthClouds.value.size) depthClouds.set(new Map(kept));
}
