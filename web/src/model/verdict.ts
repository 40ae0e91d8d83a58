// A calibration's verdict as word, sign and kind: never by colour alone.

import { Verdict, type CalibrateResult } from "../gen/posefuse/v1/room_pb";

export interface VerdictWords {
  word: string;
  icon: string;
  /** The style sheet's class. */
  kind: "ok" | "warn" | "bad" | "muted";
  /** What it means for the person who reads it. */
  meaning: string;
}

const WORDS: Record<Verdict, VerdictWords> = {
  [Verdict.PASSED]: { word: "Passed", icon: "✓", kind: "ok", meaning: "The sensors agree with each other on frames held back." },
  [Verdict.WEAK]: { word: "Weak", icon: "▲", kind: "warn", meaning: "It works, but better is possible. What to do:" },
  [Verdict.FAILED]: { word: "Failed", icon: "✕", kind: "bad", meaning: "It cannot be used. What to do:" },
  [Verdict.UNSPECIFIED]: { word: "No verdict", icon: "?", kind: "muted", meaning: "The server did not judge it." },
};

export function verdictWords(verdict: Verdict): VerdictWords {
  return WORDS[verdict] ?? WORDS[Verdict.UNSPECIFIED];
}

/** The verdict as it is written in a calibration: passed, weak, or empty where nobody judged it. */
export function storedVerdict(verdict: string): VerdictWords {
  const known: Record<string, Verdict> = { passed: Verdict.PASSED, weak: Verdict.WEAK, failed: Verdict.FAILED };
  return known[verdict] === undefined ? { ...WORDS[Verdict.UNSPECIFIED], word: verdict || "Not judged" } : WORDS[known[verdict]];
}

/** A failed one has nothing to accept, and one that is in force needs no accepting. */
export function canAccept(result: CalibrateResult): boolean {
  return result.calibration !== undefined && !result.inForce && result.verdict !== Verdict.FAILED;
}
