// The live room: keeps the four streams open while they are wanted, and turns what comes into state.
//
// A browser holds at most six connections to an origin over HTTP/1.1, and each stream is one. So raw skeletons and depth
// are streamed only while shown (all sensors' depth on one stream), no people while a take is replayed, and nothing at
// all in a hidden tab.

import { effect, signal, untracked } from "@preact/signals";
import type { RoomStatus } from "../gen/posefuse/v1/room_pb";
import type { Observation, RoomFrame } from "../gen/posefuse/v1/types_pb";
import { decodeFrame } from "../model/frame";
import { placeBodies, rigidOf } from "../model/raw";
import { explain, room } from "../net/client";
import { keepOpen, type Kept, type KeepOptions, type LinkState } from "../net/keep";
import { depthWanted, forgetDepth, takeDepth } from "./depth";
import { recordSensors, recordSpeeds } from "./plots";
import { colourOf, connection, EMPTY, frames, notify, peopleIds, rawBodies, replay, show, status, statusAt } from "./store";
import { refreshTakes } from "./takes";

const STATUS_HZ = 4;
const FRAMES_HZ = 60;
const RAW_HZ = 30;
const DEPTH_HZ = 10;
/** The server tells its state at least once a second. */
const STATUS_SILENCE_MS = 4000;
/** People who are no longer streamed vanish; raw bodies sooner, since sensors deliver steadily. */
const FRAME_STALE_MS = 1500;
const RAW_STALE_MS = 700;

const visible = signal(true);

export function startLive(): void {
  let links: Kept[] = [];
  const track = <T>(options: KeepOptions<T>) => {
    const kept = untracked(() => keepOpen(options));
    links.push(kept);
    return () => {
      links = links.filter((k) => k !== kept);
      kept.stop();
    };
  };
  document.addEventListener("visibilitychange", () => (visible.value = !document.hidden));
  addEventListener("posefuse:retry", () => links.forEach((link) => link.restart()));

  effect(() => {
    if (!visible.value) return;
    return track({
      open: (signal) => room.watchStatus({ maxRateHz: STATUS_HZ }, { signal }),
      onMessage: takeStatus,
      onState: takeLink,
      silenceMs: STATUS_SILENCE_MS,
    });
  });
  // The other streams follow the status stream: they are opened anew whenever it comes back.
  const online = signal(false);
  effect(() => {
    online.value = connection.value.kind === "online";
  });
  const live = signal(true);
  effect(() => {
    live.value = replay.value === null;
  });
  effect(() => {
    if (!visible.value || !online.value || !live.value) return;
    return track({
      open: (signal) => room.watch({ maxRateHz: FRAMES_HZ }, { signal }),
      onMessage: takeFrame,
    });
  });
  effect(() => {
    if (!visible.value || !online.value || !live.value || !show.raw.value) return;
    const stop = track({
      open: (signal) => room.watchSensors({ maxRateHz: RAW_HZ }, { signal }),
      onMessage: takeObservation,
    });
    return () => {
      stop();
      rawBodies.set(new Map());
    };
  });
  effect(() => {
    const wanted = depthWanted.value.split("\n").filter((name) => name !== "");
    untracked(() => forgetDepth(wanted));
    const [sensor, ...moreSensors] = wanted;
    if (!visible.value || !online.value || sensor === undefined) return;
    return track({
      open: (signal) => room.watchDepth({ sensor, moreSensors, maxRateHz: DEPTH_HZ }, { signal }),
      onMessage: takeDepth,
    });
  });
  setInterval(dropStale, 250);
}

/** Tries all streams again at once. */
export function retryNow(): void {
  dispatchEvent(new Event("posefuse:retry"));
}

let knownVersion = "";

function takeStatus(message: RoomStatus): void {
  const recordingBefore = status.value?.recording?.name;
  status.value = message;
  statusAt.value = performance.now();
  recordSensors(message);
  if (message.recording?.name !== recordingBefore) void refreshTakes();
  if (knownVersion && message.serverVersion !== knownVersion) {
    notify("info", `The server is now version ${message.serverVersion}. Reload this page to get its dashboard.`);
  }
  knownVersion = message.serverVersion;
}

function takeLink(state: LinkState): void {
  const before = connection.value;
  if (state.kind === "open") {
    connection.value = { kind: "online" };
    void refreshTakes();
    if (before.kind === "offline") notify("info", "The server is back.");
  } else if (state.kind === "waiting") {
    const since = before.kind === "offline" ? before.since : Date.now();
    connection.value = { kind: "offline", since, retryAtMs: state.retryAtMs, reason: explain(state.error) };
  } else if (before.kind === "offline") {
    connection.value = { ...before, retryAtMs: null };
  }
}

let frameAt = 0;

function takeFrame(message: RoomFrame): void {
  if (replay.value) return;
  frameAt = performance.now();
  showFrame(message);
}

/** Puts a frame, live or replayed, before everybody who draws it. */
export function showFrame(message: RoomFrame): void {
  const frame = decodeFrame(message);
  recordSpeeds(frame);
  const ids = frame.people.map((p) => p.id);
  if (ids.join() !== peopleIds.value.join()) peopleIds.value = ids;
  frames.set(frame);
}

export function clearView(): void {
  if (peopleIds.value.length > 0) peopleIds.value = [];
  frames.set(EMPTY);
  rawBodies.set(new Map());
}

const rawAt = new Map<number, number>();

function takeObservation(message: Observation): void {
  if (replay.value) return;
  const sensor = status.value?.sensors.find((s) => s.info?.id === message.sensor);
  const rigid = rigidOf(sensor?.roomFromSensor);
  if (!rigid) return;
  rawAt.set(message.sensor, performance.now());
  rawBodies.set(new Map(rawBodies.value).set(message.sensor, placeBodies(message, rigid, colourOf(sensor?.info?.name ?? ""))));
}

function dropStale(): void {
  if (replay.value) return;
  const now = performance.now();
  if (frames.value.people.length > 0 && now - frameAt > FRAME_STALE_MS) {
    peopleIds.value = [];
    frames.set(EMPTY);
  }
  const fresh = [...rawBodies.value].filter(([sensor]) => now - (rawAt.get(sensor) ?? 0) <= RAW_STALE_MS);
  if (fresh.length !== rawBodies.value.size) rawBodies.set(new Map(fresh));
}
