// The tab's title: what an operator must see with the page in the background.

import { effect } from "@preact/signals";
import { connection, replay, status } from "./store";

export function startTitle(): void {
  effect(() => {
    const recording = status.value?.recording;
    if (connection.value.kind === "offline") document.title = "Offline – Posefuse";
    else if (recording) document.title = `● REC ${recording.name} – Posefuse`;
    else if (replay.value) document.title = `Replay ${replay.value.take.name} – Posefuse`;
    else document.title = "Posefuse";
  });
}
