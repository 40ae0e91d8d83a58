// Timecode of the room: the time of day as HH:MM:SS:FF, counted as the server counts it (skeleton/src/timecode.rs).

const DAY_NS = 86_400_000_000_000n;
/** An instant so little before a frame counts as in it. */
const EARLY_NS = 1000n;
/** Labels of a drop-frame minute that skips two, and of ten minutes. */
const SHORT_MINUTE = 1798;
const TEN_MINUTES = 17_982;

interface Rate {
  /** Frames a second are `frames / seconds`. */
  frames: number;
  seconds: number;
  labels: number;
  drop: boolean;
}

function rateOf(name: string): Rate | undefined {
  if (name === "29.97df") return { frames: 30_000, seconds: 1001, labels: 30, drop: true };
  const labels = Number(name);
  return [24, 25, 30, 50, 60].includes(labels) ? { frames: labels, seconds: 1, labels, drop: false } : undefined;
}

/** Nanoseconds since the room's midnight, of civil time in nanoseconds since 1970. */
export function dayNs(unixNs: bigint, utcOffsetS: number): number {
  const local = unixNs + BigInt(utcOffsetS) * 1_000_000_000n;
  return Number(((local % DAY_NS) + DAY_NS) % DAY_NS);
}

/** The label of the frame that so many nanoseconds after midnight fall into; empty: the rate is not known. */
export function timecode(rateName: string, sinceMidnightNs: number): string {
  const rate = rateOf(rateName);
  if (!rate) return "";
  const day = BigInt(Math.floor(Math.min(Math.max(sinceMidnightNs, 0), Number(DAY_NS) - 1)));
  let number = Number(((day + EARLY_NS) * BigInt(rate.frames)) / (BigInt(rate.seconds) * 1_000_000_000n));
  // The last label is held until midnight: a drop-frame day is 2.6 frames longer than its labels.
  number = Math.min(number, (rate.drop ? 144 * TEN_MINUTES : 86_400 * rate.labels) - 1);
  if (rate.drop) {
    const minutes = Math.floor(Math.max((number % TEN_MINUTES) - 2, 0) / SHORT_MINUTE);
    number += 2 * (9 * Math.floor(number / TEN_MINUTES) + minutes);
  }
  const seconds = Math.floor(number / rate.labels);
  const two = (n: number) => String(n).padStart(2, "0");
  const [h, m, s] = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60];
  return `${two(h)}:${two(m)}:${two(s)}${rate.drop ? ";" : ":"}${two(number % rate.labels)}`;
}
