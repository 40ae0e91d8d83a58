// Keeps a server stream open: opens it, hands on its messages, and after any end waits and opens it again.

import { delayMs, RECONNECT, type BackoffPolicy } from "../model/backoff";

export type LinkState =
  | { kind: "opening"; attempt: number }
  | { kind: "open" }
  | { kind: "waiting"; attempt: number; retryAtMs: number; error: unknown };

export interface KeepOptions<T> {
  open(signal: AbortSignal): AsyncIterable<T>;
  onMessage(message: T): void;
  onState?(state: LinkState): void;
  /** A stream that says nothing for so long counts as dead; absent: it may be silent. */
  silenceMs?: number;
  policy?: BackoffPolicy;
}

export interface Kept {
  /** Ends the stream for good. */
  stop(): void;
  /** Closes what is open, or stops waiting, and opens at once. */
  restart(): void;
}

class Silence extends Error {
  constructor(ms: number) {
    super(`The server said nothing for ${ms / 1000} s.`);
  }
}

export function keepOpen<T>(options: KeepOptions<T>): Kept {
  const policy = options.policy ?? RECONNECT;
  let stopped = false;
  let attempt = 0;
  let current = new AbortController();
  let wake: (() => void) | null = null;

  const once = async (): Promise<unknown> => {
    current = new AbortController();
    const abort = current;
    let dead: Silence | null = null;
    let timer: ReturnType<typeof setTimeout> | undefined;
    const arm = () => {
      clearTimeout(timer);
      if (options.silenceMs === undefined) return;
      const ms = options.silenceMs;
      timer = setTimeout(() => {
        dead = new Silence(ms);
        abort.abort();
      }, ms);
    };
    try {
      options.onState?.({ kind: "opening", attempt });
      arm();
      let first = true;
      for await (const message of options.open(abort.signal)) {
        if (stopped || abort.signal.aborted) break;
        arm();
        if (first) options.onState?.({ kind: "open" });
        first = false;
        attempt = 0;
        options.onMessage(message);
      }
      return dead ?? new Error("The server closed the stream.");
    } catch (error) {
      return dead ?? error;
    } finally {
      clearTimeout(timer);
      abort.abort();
    }
  };

  let hurry = false;
  const run = async () => {
    while (!stopped) {
      const error = await once();
      if (stopped) return;
      if (hurry) {
        hurry = false;
        continue;
      }
      const wait = delayMs(policy, attempt, Math.random());
      options.onState?.({ kind: "waiting", attempt, retryAtMs: Date.now() + wait, error });
      attempt += 1;
      await new Promise<void>((resolve) => {
        const timer = setTimeout(resolve, wait);
        wake = () => {
          clearTimeout(timer);
          resolve();
        };
      });
      wake = null;
      hurry = false;
    }
  };
  void run();

  return {
    stop: () => {
      stopped = true;
      current.abort();
      wake?.();
    },
    restart: () => {
      hurry = wake === null;
      wake?.();
      current.abort();
    },
  };
}
