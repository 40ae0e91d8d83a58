// Calibration from a walk: one stream, which the server ends with a result; closing it early cancels. The server is
// asked for the result only: it comes into force when the operator accepts it.

import { signal } from "@preact/signals";
import { explain, isCancelled, room } from "../net/client";
import { calibrating, notify } from "./store";

/** Whether the wizard fills the window while somebody walks, in letters that are read across the room. */
export const large = signal(true);

/** Whether the walk ends when enough has been seen rather than on a clock. */
export const untilEnough = signal(true);

/** Gathers for so many seconds; 0: until enough has been seen. */
export async function calibrate(seconds: number): Promise<void> {
  untilEnough.value = seconds === 0;
  const abort = new AbortController();
  const cancel = () => abort.abort();
  calibrating.value = { kind: "running", progress: null, cancel };
  try {
    for await (const { event } of room.calibrate({ seconds, dryRun: true }, { signal: abort.signal })) {
      if (event.case === "progress") calibrating.value = { kind: "running", progress: event.value, cancel };
      if (event.case === "result") {
        const decision = event.value.inForce ? ({ kind: "accepted" } as const) : ({ kind: "open", trouble: "" } as const);
        calibrating.value = { kind: "done", result: event.value, decision };
        return;
      }
    }
    calibrating.value = { kind: "failed", trouble: "The server ended the calibration without a result." };
  } catch (error) {
    if (abort.signal.aborted || isCancelled(error)) calibrating.value = { kind: "intro" };
    else calibrating.value = { kind: "failed", trouble: explain(error) };
  }
}

/** Puts the result that is shown in force. */
export async function accept(): Promise<void> {
  const shown = calibrating.value;
  if (shown.kind !== "done" || shown.decision.kind !== "open" || !shown.result.calibration) return;
  const decide = (decision: typeof shown.decision | { kind: "busy" } | { kind: "accepted" }) => {
    const now = calibrating.value;
    if (now.kind === "done" && now.result === shown.result) calibrating.value = { ...now, decision };
  };
  decide({ kind: "busy" });
  try {
    await room.setCalibration({ calibration: shown.result.calibration }, { timeoutMs: 10_000 });
    decide({ kind: "accepted" });
    notify("info", "The new calibration is in force.");
  } catch (error) {
    decide({ kind: "open", trouble: explain(error) });
  }
}

export function closeCalibrate(): void {
  calibrating.value = { kind: "closed" };
}

export function repeatCalibrate(): void {
  calibrating.value = { kind: "intro" };
}
