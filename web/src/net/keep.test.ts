import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { keepOpen, type LinkState } from "./keep";

const policy = { firstMs: 100, capMs: 400, jitter: 0 };

/** A stream that gives `messages` and then fails, ends, or stays silent until it is aborted. */
async function* stream(messages: string[], end: "fail" | "close" | "hang", signal: AbortSignal) {
  yield* messages;
  if (end === "fail") throw new Error("broken");
  if (end === "hang") await new Promise((_, reject) => signal.addEventListener("abort", () => reject(new Error("aborted"))));
}

describe("a kept stream", () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  it("comes back with growing pauses until it works, then starts from the shortest again", async () => {
    let opened = 0;
    const waits: number[] = [];
    const got: string[] = [];
    const kept = keepOpen({
      policy,
      open: (signal) => {
        opened += 1;
        return stream(opened === 4 ? ["hello"] : [], "fail", signal);
      },
      onMessage: (m) => got.push(m),
      onState: (s: LinkState) => s.kind === "waiting" && waits.push(s.retryAtMs - Date.now()),
    });
    await vi.advanceTimersByTimeAsync(850);
    kept.stop();
    expect(got).toEqual(["hello"]);
    expect(waits.slice(0, 4)).toEqual([100, 200, 400, 100]);
  });

  it("counts silence as death, and says so", async () => {
    const errors: unknown[] = [];
    const states: string[] = [];
    const kept = keepOpen({
      policy,
      silenceMs: 1000,
      open: (signal) => stream(["one"], "hang", signal),
      onMessage: () => undefined,
      onState: (s) => {
        states.push(s.kind);
        if (s.kind === "waiting") errors.push(s.error);
      },
    });
    await vi.advanceTimersByTimeAsync(999);
    expect(states).toEqual(["opening", "open"]);
    await vi.advanceTimersByTimeAsync(2);
    kept.stop();
    expect(states).toEqual(["opening", "open", "waiting"]);
    expect(String(errors[0])).toContain("said nothing for 1 s");
  });

  it("opens at once when told to, waiting or not", async () => {
    let opened = 0;
    const kept = keepOpen({
      policy: { firstMs: 60_000, capMs: 60_000, jitter: 0 },
      open: (signal) => {
        opened += 1;
        return stream([], opened === 1 ? "close" : "hang", signal);
      },
      onMessage: () => undefined,
    });
    await vi.advanceTimersByTimeAsync(10);
    expect(opened).toBe(1);
    kept.restart();
    await vi.advanceTimersByTimeAsync(10);
    expect(opened).toBe(2);
    kept.restart();
    await vi.advanceTimersByTimeAsync(10);
    expect(opened).toBe(3);
    kept.stop();
  });

  it("stays ended once stopped", async () => {
    let opened = 0;
    const states: string[] = [];
    const kept = keepOpen({
      policy,
      open: (signal) => {
        opened += 1;
        return stream(["x"], "hang", signal);
      },
      onMessage: () => undefined,
      onState: (s) => states.push(s.kind),
    });
    await vi.advanceTimersByTimeAsync(10);
    kept.stop();
    await vi.advanceTimersByTimeAsync(5000);
    expect(opened).toBe(1);
    expect(states).toEqual(["opening", "open"]);
  });
});
