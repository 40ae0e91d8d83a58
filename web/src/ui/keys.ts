// Keyboard shortcuts: one table, which both the handler and the help dialog read.

import { calibrating, canCalibrate, dialog, followed, peopleIds, chosenId, replay, show } from "../state/store";
import { closeReplay, seek, togglePlay } from "../state/replay";
import { planOpen } from "../state/plan";
import { singleKeys, toggleTheme } from "../state/prefs";
import { toggleRecording } from "../state/takes";
import type { Preset } from "../scene/room";

export interface Shortcut {
  key: string;
  /** How it is written in the help. */
  label: string;
  text: string;
  run(): void;
  /** Absent: always. */
  when?: () => boolean;
}

/** Set by the 3D view. */
export const view: { look(preset: Preset): void } = { look: () => undefined };

const replaying = () => replay.value !== null;

export const SHORTCUTS: Shortcut[] = [
  { key: "r", label: "R", text: "Start or stop recording", run: () => void toggleRecording(), when: () => !replaying() },
  { key: "k", label: "K", text: "Calibrate", run: openCalibrate, when: () => !replaying() },
  { key: "1", label: "1", text: "View from the front", run: () => view.look("front") },
  { key: "2", label: "2", text: "View from the top", run: () => view.look("top") },
  { key: "3", label: "3", text: "View from the side", run: () => view.look("side") },
  { key: "f", label: "F", text: "Fit everything into the view", run: () => view.look("fit") },
  { key: "w", label: "W", text: "Raw skeletons of the sensors", run: () => flip(show.raw) },
  { key: "u", label: "U", text: "Uncertainty halos", run: () => flip(show.halos) },
  { key: "c", label: "C", text: "View cones of the sensors", run: () => flip(show.cones) },
  { key: "d", label: "D", text: "Depth in the room, of open previews", run: () => flip(show.clouds) },
  { key: "o", label: "O", text: "Plan the room", run: () => flip(planOpen) },
  { key: "l", label: "L", text: "Labels", run: () => flip(show.labels) },
  { key: "p", label: "P", text: "Follow the next person in the plots", run: nextPerson },
  { key: " ", label: "Space", text: "Replay: play or pause", run: togglePlay, when: replaying },
  { key: ",", label: ",", text: "Replay: back one second", run: () => seek((replay.value?.offsetS ?? 0) - 1), when: replaying },
  { key: ".", label: ".", text: "Replay: on one second", run: () => seek((replay.value?.offsetS ?? 0) + 1), when: replaying },
  { key: "Escape", label: "Esc", text: "Replay: back to live", run: closeReplay, when: replaying },
  { key: "t", label: "T", text: "Light or dark", run: toggleTheme },
  { key: "?", label: "?", text: "This list", run: () => (dialog.value = "help") },
];

function flip(on: { value: boolean }): void {
  on.value = !on.value;
}

export function openCalibrate(): void {
  if (canCalibrate.value) calibrating.value = { kind: "intro" };
}

function nextPerson(): void {
  const ids = peopleIds.value;
  if (ids.length > 0) chosenId.value = ids[(ids.indexOf(followed.value ?? "") + 1) % ids.length]!;
}

/** True where a key press belongs to the element that has the focus. */
function typing(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.closest("dialog")) return true;
  if (target.matches("textarea, select") || target.isContentEditable) return true;
  if (target instanceof HTMLInputElement) return target.type !== "range" && target.type !== "checkbox";
  return key === " " && target.matches("button, summary, a");
}

export function startKeys(): void {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented || event.repeat) return;
    if (typing(event.target, event.key)) return;
    if (!singleKeys.value && event.key.length === 1) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const shortcut = SHORTCUTS.find((s) => s.key === key && (s.when?.() ?? true));
    if (!shortcut) return;
    event.preventDefault();
    shortcut.run();
  });
}
