// What other programs' orders to start and stop takes came to, a line for each way by which they come.

import type { TriggerStatus } from "../gen/posefuse/v1/room_pb";
import { ago } from "./format";

const NAMES: Record<string, string> = { http: "HTTP", osc: "OSC", capture: "CaptureStart" };

export interface TriggerLine {
  key: string;
  name: string;
  place: string;
  text: string;
  alert: boolean;
}

/** HTTP is always there: it has a line once somebody used it. */
export function triggerLines(triggers: readonly TriggerStatus[], nowUnixMs: number): TriggerLine[] {
  return triggers
    .filter((t) => t.name !== "http" || t.latest !== "")
    .map((t) => {
      const when = t.latest === "" ? "" : ago(Number(t.latestUnixNs / 1_000_000n), nowUnixMs);
      const text = t.trouble || (t.latest ? `${t.latest}, ${when}` : "waits for an order");
      return { key: t.name, name: NAMES[t.name] ?? t.name, place: t.place, text, alert: t.trouble !== "" || t.latestRefused };
    });
}
