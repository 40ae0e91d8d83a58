// Calibration from a walk: one stream, which the server ends with a result; closing it early cancels.

import { explain, isCancelled, room } from "../net/client";
import { calibrating } from "./store";

export async function calibrate(seconds: number, dryRun: boolean): Promise<void> {
  const abort = new AbortController();
  const cancel = () => abort.abort();
  calibrating.value = { kind: "running", progress: null, cancel };
  try {
    for await (const { event } of room.calibrate({ seconds, dryRun }, { signal: abort.signal })) {
      if (event.case === "progress") calibrating.value = { kind: "running", progress: event.value, cancel };
      if (event.case === "result") {
        calibrating.value = { kind: "done", result: event.value };
        return;
      }
    }
    calibrating.value = { kind: "failed", trouble: "The server ended the calibration without a result." };
  } catch (error) {
    if (abort.signal.aborted || isCancelled(error)) calibrating.value = { kind: "intro" };
    else calibrating.value = { kind: "failed", trouble: explain(error) };
  }
}
