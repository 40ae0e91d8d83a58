// Replay of a take. The server paces the stream; pausing ends it and remembers where, seeking opens it elsewhere.

import { signal } from "@preact/signals";
import type { ReplayEvent, Take } from "../gen/posefuse/v1/room_pb";
import type { Calibration } from "../gen/posefuse/v1/types_pb";
import { secondsOf } from "../model/frame";
import { placeBodies, rigidOf, type Rigid } from "../model/raw";
import { explain, isCancelled, room } from "../net/client";
import { clearView, showFrame } from "./live";
import { forgetSpeeds } from "./plots";
import { colourOf, rawBodies, replay, show, type Replay } from "./store";

export const SPEEDS = [0.25, 0.5, 1, 2, 4] as const;

const SEEK_REST_MS = 80;

let abort: AbortController | null = null;
let pending: ReturnType<typeof setTimeout> | undefined;
/** Where the replayed take's sensors stand, by sensor id; also what the 3D view draws. */
export const replayPlaces = signal<ReadonlyMap<number, { name: string; rigid: Rigid }>>(new Map());

export function openReplay(take: Take): void {
  clearTimeout(pending);
  clearView();
  forgetSpeeds();
  replayPlaces.value = new Map();
  replay.value = {
    take, durationS: secondsOf(take.durationNs), offsetS: 0, speed: replay.value?.speed ?? 1, state: "loading", trouble: "",
  };
  void play(0);
}

export function closeReplay(): void {
  clearTimeout(pending);
  abort?.abort();
  abort = null;
  replay.value = null;
  forgetSpeeds();
  clearView();
}

export function togglePlay(): void {
  const r = replay.value;
  if (!r) return;
  clearTimeout(pending);
  if (r.state === "playing" || r.state === "loading") {
    abort?.abort();
    patch({ state: "paused" });
  } else {
    void play(r.state === "ended" ? 0 : r.offsetS);
  }
}

/** Goes to `seconds` from the take's start; a paused take shows that instant and stays paused. */
export function seek(seconds: number): void {
  const r = replay.value;
  if (!r) return;
  const to = Math.min(Math.max(seconds, 0), r.durationS);
  const still = r.state === "paused" || r.state === "ended";
  abort?.abort();
  patch({ offsetS: to, state: still ? "paused" : "loading" });
  // A slider that is dragged asks many times a second; only where it rests is streamed.
  clearTimeout(pending);
  pending = setTimeout(() => void play(to, still), SEEK_REST_MS);
}

export function setSpeed(speed: number): void {
  const r = replay.value;
  if (!r) return;
  patch({ speed });
  if (r.state === "playing") void play(r.offsetS);
}

function patch(change: Partial<Replay>): void {
  if (replay.value) replay.value = { ...replay.value, ...change };
}

/** Streams from `fromS` on; with `still` only until the first frame is there. */
async function play(fromS: number, still = false): Promise<void> {
  abort?.abort();
  const mine = new AbortController();
  abort = mine;
  const name = replay.value?.take.name;
  if (name === undefined) return;
  patch({ state: still ? "paused" : "loading", trouble: "" });
  try {
    const request = { name, startNs: BigInt(Math.round(fromS * 1e9)), speed: replay.value?.speed ?? 1 };
    for await (const event of room.replayTake(request, { signal: mine.signal })) {
      if (mine.signal.aborted) return;
      const framed = takeEvent(event);
      if (still && framed) return mine.abort();
      if (!still && framed) showProgress(event);
    }
    if (!mine.signal.aborted) patch({ state: "ended", offsetS: still ? fromS : (replay.value?.durationS ?? 0) });
  } catch (error) {
    if (mine.signal.aborted || isCancelled(error)) return;
    patch({ state: "failed", trouble: explain(error) });
  }
}

/** The page need not render at every frame: ten times a second is enough for a slider. */
function showProgress(event: ReplayEvent): void {
  const offsetS = secondsOf(event.offsetNs);
  const r = replay.value;
  if (!r) return;
  if (r.state !== "playing" || Math.abs(offsetS - r.offsetS) >= 0.1 * Math.max(1, r.speed)) {
    patch({ state: "playing", offsetS, durationS: Math.max(r.durationS, offsetS) });
  }
}

/** True when the event was a fused frame. */
function takeEvent(event: ReplayEvent): boolean {
  switch (event.event.case) {
    case "start": {
      const { take, sensors, calibration } = event.event.value;
      for (const sensor of sensors) place(sensor.id, sensor.name, calibration);
      if (take) patch({ take, durationS: Math.max(secondsOf(take.durationNs), replay.value?.durationS ?? 0) });
      return false;
    }
    case "frame":
      showFrame(event.event.value);
      return true;
    case "observation": {
      const place = replayPlaces.value.get(event.event.value.sensor);
      if (place && show.raw.value) {
        rawBodies.set(new Map(rawBodies.value).set(event.event.value.sensor, placeBodies(event.event.value, place.rigid, colourOf(place.name))));
      }
      return false;
    }
    default:
      return false;
  }
}

function place(id: number, name: string, calibration: Calibration | undefined): void {
  const rigid = rigidOf(calibration?.sensors.find((s) => s.sensor === name)?.roomFromSensor);
  if (rigid) replayPlaces.value = new Map(replayPlaces.value).set(id, { name, rigid });
}
