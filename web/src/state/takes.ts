// Takes: recording them, listing them, changing their words.

import { room, explain } from "../net/client";
import { nextTakeName } from "../model/format";
import { notify, replay, status, takes, takesTrouble } from "./store";
import { signal } from "@preact/signals";

export interface TakeForm {
  name: string;
  slate: string;
  notes: string;
}

export const takeForm = signal<TakeForm>({ name: "", slate: "", notes: "" });
/** True between the click and the server's answer. */
export const takeBusy = signal(false);

let asked = 0;

export async function refreshTakes(): Promise<void> {
  const mine = ++asked;
  try {
    const answer = await room.listTakes({}, { timeoutMs: 10_000 });
    if (mine !== asked) return;
    takes.value = [...answer.takes].sort((a, b) => (a.started < b.started ? 1 : a.started > b.started ? -1 : 0));
    takesTrouble.value = "";
  } catch (error) {
    if (mine === asked) takesTrouble.value = explain(error);
  }
}

export async function toggleRecording(): Promise<void> {
  if (takeBusy.value || !status.value) return;
  takeBusy.value = true;
  try {
    if (status.value.recording) await stop();
    else if (!replay.value) await start();
  } catch (error) {
    notify("error", explain(error));
  } finally {
    takeBusy.value = false;
  }
}

async function start(): Promise<void> {
  const { name, slate, notes } = takeForm.value;
  const take = await room.startTake({ name: name.trim(), slate: slate.trim(), notes: notes.trim() });
  if (status.value && !status.value.recording) status.value = { ...status.value, recording: take };
}

async function stop(): Promise<void> {
  const take = await room.stopTake({});
  const { name, slate } = takeForm.value;
  takeForm.value = { name: nextTakeName(name), slate, notes: "" };
  if (status.value) {
    const { recording: _gone, ...rest } = status.value;
    status.value = rest;
  }
  notify("info", `Take ${take.name} is complete.`);
  await refreshTakes();
}

export async function updateTake(name: string, words: { slate: string; notes: string }): Promise<boolean> {
  try {
    const changed = await room.updateTake({ name, ...words });
    takes.value = takes.value.map((t) => (t.name === name ? changed : t));
    return true;
  } catch (error) {
    notify("error", explain(error));
    return false;
  }
}
