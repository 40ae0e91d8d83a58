// Switching live outputs, and how many frames a second each sends.

import { effect, signal } from "@preact/signals";
import { CounterRates } from "../model/sinks";
import { secondsOf } from "../model/frame";
import { explain, room } from "../net/client";
import { notify, status } from "./store";

/** Outputs whose switch the server has not answered yet. */
export const switching = signal<ReadonlySet<string>>(new Set());
/** Frames a second, lately, by the output's name. */
export const sinkRates = signal<ReadonlyMap<string, number | undefined>>(new Map());

export function startSinkRates(): void {
  const rates = new CounterRates();
  effect(() => {
    const now = status.value;
    if (!now) return;
    const atS = secondsOf(now.timeNs);
    sinkRates.value = new Map(now.sinks.map((sink) => [sink.name, rates.add(sink.name, atS, sink.delivered)]));
  });
}

export async function switchSink(name: string, on: boolean): Promise<void> {
  if (switching.value.has(name)) return;
  switching.value = new Set(switching.value).add(name);
  try {
    const changed = await room.switchSink({ name, on }, { timeoutMs: 10_000 });
    const now = status.value;
    if (now) status.value = { ...now, sinks: now.sinks.map((s) => (s.name === name ? changed : s)) };
  } catch (error) {
    notify("error", explain(error));
  } finally {
    switching.value = new Set([...switching.value].filter((other) => other !== name));
  }
}
