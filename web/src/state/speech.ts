// The walk's hints, spoken: whoever walks looks at the sensors rather than at the screen. Only with a voice that lives
// on this computer; others would send the words elsewhere.

import { effect, signal } from "@preact/signals";
import { instruction } from "../model/coverage";
import { verdictWords } from "../model/verdict";
import { calibrating, sensorNames } from "./store";

export const speaking = signal(false);
/** Whether there is a voice to speak with. */
export const voice = signal<SpeechSynthesisVoice | null>(null);

/** A hint that changes again within this time is not spoken. */
const REST_MS = 1200;

export function startSpeech(): void {
  if (typeof speechSynthesis === "undefined") return;
  const find = () => {
    const local = speechSynthesis.getVoices().filter((v) => v.localService);
    voice.value = local.find((v) => v.lang.startsWith("en")) ?? null;
  };
  find();
  speechSynthesis.addEventListener?.("voiceschanged", find);
  let said = "";
  let pending: ReturnType<typeof setTimeout> | undefined;
  effect(() => {
    const words = speaking.value && voice.value ? wordsNow() : "";
    clearTimeout(pending);
    if (!words) said = "";
    if (!words || words === said) return;
    pending = setTimeout(() => {
      said = words;
      say(words);
    }, REST_MS);
  });
}

function wordsNow(): string {
  const c = calibrating.value;
  if (c.kind === "running" && c.progress) return instruction(c.progress, sensorNames.value);
  if (c.kind === "done") return `Calibration ${verdictWords(c.result.verdict).word}.`;
  return "";
}

function say(words: string): void {
  const utterance = new SpeechSynthesisUtterance(words);
  utterance.voice = voice.value;
  speechSynthesis.cancel();
  speechSynthesis.speak(utterance);
}
