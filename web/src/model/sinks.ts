// Live outputs as cards: their names, states in words, and how many frames a second they truly send.

import { SinkState, type SinkStatus } from "../gen/posefuse/v1/room_pb";
import { count, fixed, plural } from "./format";

/** What outputs are called; others go by their own name. */
const NAMES: Record<string, string> = {
  vmc: "VMC",
  osc: "OSC",
  websocket: "WebSocket",
  foxglove: "Foxglove",
  lsl: "LSL",
  zenoh: "Zenoh",
  rosbridge: "rosbridge",
  natnet: "NatNet",
  watch: "Fused frames",
  "watch-sensors": "Raw skeletons",
  recorder: "Recorder",
  bodies: "Bodies for outputs",
};

/** Whom an output is for, in a few words. */
const FOR: Record<string, string> = {
  vmc: "Unity, Unreal, Blender, VTubing",
  osc: "TouchDesigner, Max, Pure Data",
  websocket: "web pages and scripts",
  foxglove: "Foxglove",
  lsl: "labs: LabRecorder, pylsl",
  zenoh: "Zenoh and ROS 2",
  rosbridge: "roslibpy, roslibjs",
  natnet: "OptiTrack clients",
  watch: "gRPC Watch: dashboards, Python, the command line",
  "watch-sensors": "gRPC WatchSensors",
  recorder: "The take on the disk",
};

export const sinkName = (sink: SinkStatus) => NAMES[sink.name] ?? sink.name;
export const sinkFor = (sink: SinkStatus) => FOR[sink.name] ?? "";

/** Outputs that can be switched; the others are there for whoever asks. */
export const canSwitch = (sink: SinkStatus) => sink.state !== SinkState.UNSPECIFIED;

export interface SinkWords {
  /** For tests and styles. */
  name: "off" | "running" | "failing";
  word: string;
  icon: string;
  kind: "muted" | "ok" | "bad";
  on: boolean;
}

export function sinkState(sink: SinkStatus): SinkWords {
  if (sink.state === SinkState.FAILING) return { name: "failing", word: "Failing", icon: "✕", kind: "bad", on: true };
  if (sink.state === SinkState.RUNNING) return { name: "running", word: "Running", icon: "●", kind: "ok", on: true };
  return { name: "off", word: "Off", icon: "○", kind: "muted", on: false };
}

export interface SinkFigure {
  name: string;
  value: string;
  title: string;
  alert?: boolean;
  /** Takes the room of two. */
  wide?: boolean;
}

/** The figures of a card; none while the output is off. */
export function sinkFigures(sink: SinkStatus, perSecond: number | undefined): SinkFigure[] {
  if (!sinkState(sink).on) return [];
  const most = sink.rateHz > 0 ? `at most ${fixed(sink.rateHz, 0)}` : "every frame";
  const figures: SinkFigure[] = [
    { name: "Rate", value: fixed(perSecond, 1, "fps"), title: `Frames sent a second, lately; set to ${most}` },
    { name: "Delivered", value: count(sink.delivered), title: "Frames that went out since the server started" },
    { name: "Dropped", value: count(sink.dropped), title: "Frames lost because this output was slow", alert: sink.dropped > 0n },
    {
      name: "Adds p50 / p99", wide: true, value: `${fixed(sink.p50Ms, 2)} / ${fixed(sink.p99Ms, 2, "ms")}`,
      title: "What this output adds, from the fused frame to the operating system",
    },
  ];
  if (sink.clients !== undefined) figures.push({ name: "Clients", value: String(sink.clients), title: `${plural(sink.clients, "program")} connected` });
  return figures;
}

/** How fast counters grow, over the last few seconds. */
export class CounterRates {
  private samples = new Map<string, { atS: number; value: bigint }[]>();

  constructor(private readonly windowS = 3) {}

  /** `undefined` until there are two samples, and after a counter began anew. */
  add(name: string, atS: number, value: bigint): number | undefined {
    const list = this.samples.get(name) ?? [];
    const last = list.at(-1);
    if (last && (value < last.value || atS < last.atS)) list.length = 0;
    list.push({ atS, value });
    while (list.length > 2 && atS - list[1]!.atS >= this.windowS) list.shift();
    this.samples.set(name, list);
    const first = list[0]!;
    return atS > first.atS ? Number(value - first.value) / (atS - first.atS) : undefined;
  }
}
