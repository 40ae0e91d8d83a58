// What the page knows, as signals. Whatever changes with every frame goes through `frames` instead, so that
// thirty frames a second do not render thirty pages a second.

import { computed, signal } from "@preact/signals";
import type { CalibrateProgress, CalibrateResult, RoomStatus, SensorStatus, Take } from "../gen/posefuse/v1/room_pb";
import { SensorState } from "../gen/posefuse/v1/room_pb";
import { assignColours, usualColour } from "../model/colours";
import type { Frame } from "../model/frame";
import type { RawBody } from "../model/raw";

export type Connection =
  | { kind: "connecting" }
  | { kind: "online" }
  | { kind: "offline"; since: number; retryAtMs: number | null; reason: string };

export const connection = signal<Connection>({ kind: "connecting" });
export const status = signal<RoomStatus | null>(null);
/** When `status` came, by `performance.now()`: running figures count on from there. */
export const statusAt = signal(0);

export const sensors = computed<SensorStatus[]>(() =>
  [...(status.value?.sensors ?? [])].sort((a, b) => (a.info?.name ?? "").localeCompare(b.info?.name ?? "", "en", { numeric: true })),
);
export const sensorNames = computed(() => sensors.value.map((s) => s.info?.name ?? ""));
const colours = computed(() => assignColours(sensorNames.value));

/** The colour of the sensor of this name, 0 to 6; one of a take that the room does not know has its usual one. */
export function colourOf(name: string): number {
  return colours.value.get(name) ?? usualColour(name);
}

/** Those that legends name: the others have nothing on the page. */
export const shownSensors = computed(() => sensors.value.filter((s) => s.calibrated || s.state === SensorState.LIVE));
export const calibratedSensors = computed(() => sensors.value.filter((s) => s.calibrated).length);
export const liveSensors = computed(() => sensors.value.filter((s) => s.state === SensorState.LIVE).length);

export interface Replay {
  take: Take;
  durationS: number;
  offsetS: number;
  speed: number;
  state: "loading" | "playing" | "paused" | "ended" | "failed";
  trouble: string;
}

/** Null while the page shows the live room. */
export const replay = signal<Replay | null>(null);

export const takes = signal<Take[]>([]);
export const takesTrouble = signal("");

/** Ids of the people in view, in order; changes only when somebody comes or goes. */
export const peopleIds = signal<string[]>([]);
export const chosenId = signal<string | null>(null);
/** Who the plots follow: the chosen person while there, else the first. */
export const followed = computed(() => {
  const ids = peopleIds.value;
  return chosenId.value !== null && ids.includes(chosenId.value) ? chosenId.value : (ids[0] ?? null);
});

export const show = {
  raw: signal(false),
  halos: signal(true),
  cones: signal(true),
  labels: signal(true),
  clouds: signal(true),
};

export type Calibrating =
  | { kind: "closed" }
  | { kind: "intro" }
  | { kind: "running"; progress: CalibrateProgress | null; cancel(): void }
  | { kind: "done"; result: CalibrateResult; decision: Decision }
  | { kind: "failed"; trouble: string };

/** What becomes of a result: it is in force only once somebody accepts it. */
export type Decision = { kind: "open"; trouble: string } | { kind: "busy" } | { kind: "accepted" };

export const calibrating = signal<Calibrating>({ kind: "closed" });

/** Why nobody can calibrate now: it needs a server, sensors, the live room, and no take running. Empty: one can. */
export const calibrateBlocked = computed(() => {
  if (connection.value.kind !== "online") return "The server does not answer.";
  if (sensors.value.length === 0) return "No sensor has joined yet.";
  if (replay.value !== null) return "Go back to the live room first.";
  if (status.value?.recording !== undefined) return "Stop the recording first.";
  if (calibrating.value.kind !== "closed") return "Calibration is open already.";
  if (status.value?.calibrating) return "Somebody else is calibrating.";
  return "";
});
export const canCalibrate = computed(() => calibrateBlocked.value === "");

export type DialogName = "help" | "config" | "calibrations" | "weights" | "recalibrated" | "depth";
export const dialog = signal<"none" | DialogName>("none");

export interface Notice {
  id: number;
  kind: "info" | "error";
  text: string;
}
export const notices = signal<Notice[]>([]);
let noticeId = 0;

/** Shows a sentence for a while; errors stay until they are dismissed. */
export function notify(kind: Notice["kind"], text: string): void {
  const id = ++noticeId;
  notices.value = [...notices.value.filter((n) => n.text !== text).slice(-3), { id, kind, text }];
  if (kind === "info") setTimeout(() => dismiss(id), 6000);
}

export function dismiss(id: number): void {
  notices.value = notices.value.filter((n) => n.id !== id);
}

type Listener<T> = (value: T) => void;

/** A value that changes with every frame. */
export class Feed<T> {
  private listeners = new Set<Listener<T>>();

  constructor(public value: T) {}

  set(value: T): void {
    this.value = value;
    for (const listener of this.listeners) listener(value);
  }

  on(listener: Listener<T>): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
}

export const EMPTY: Frame = { time: 0, people: [], malformed: 0 };
export const frames = new Feed<Frame>(EMPTY);
/** Raw bodies of each sensor's latest observation, by sensor id. */
export const rawBodies = new Feed<ReadonlyMap<number, RawBody[]>>(new Map());
