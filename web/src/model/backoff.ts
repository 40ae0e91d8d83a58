// How long to wait before the next attempt to reach the server.

export interface BackoffPolicy {
  firstMs: number;
  capMs: number;
  /** Share of the delay that is random, 0 to 1, so that many pages do not return at one instant. */
  jitter: number;
}

export const RECONNECT: BackoffPolicy = { firstMs: 500, capMs: 8000, jitter: 0.25 };

/** The delay before attempt number `attempt` (0 is the first retry); `random` is 0 to 1. */
export function delayMs(policy: BackoffPolicy, attempt: number, random: number): number {
  const full = Math.min(policy.capMs, policy.firstMs * 2 ** Math.min(attempt, 30));
  return Math.round(full * (1 - policy.jitter * random));
}
