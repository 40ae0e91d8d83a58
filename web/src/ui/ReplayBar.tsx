// The transport of a replayed take.

import { useEffect, useRef } from "preact/hooks";
import { duration } from "../model/format";
import { replay } from "../state/store";
import { closeReplay, seek, setSpeed, SPEEDS, togglePlay } from "../state/replay";

export function ReplayBar() {
  const play = useRef<HTMLButtonElement>(null);
  // Opening a take takes away the button that was pressed, going back takes away this bar: the focus moves along.
  useEffect(() => {
    play.current?.focus();
    return () => document.querySelector<HTMLElement>(".stage")?.focus();
  }, []);
  const r = replay.value;
  if (!r) return null;
  const running = r.state === "playing" || r.state === "loading";
  return (
    <section class="transport replaying" aria-label="Replay" data-testid="replay-bar" data-state={r.state}>
      <button type="button" ref={play} class="play" data-testid="play" aria-keyshortcuts="Space" onClick={togglePlay}>
        <span aria-hidden="true">{running ? "❚❚" : "▶"}</span> {running ? "Pause" : r.state === "ended" ? "Again" : "Play"}
      </button>
      <span class="tabular replay-time" data-testid="replay-time">
        {duration(r.offsetS, true)} / {duration(r.durationS, true)}
      </span>
      <input
        type="range"
        class="seek"
        min={0}
        max={Math.max(r.durationS, 0.1)}
        step={0.1}
        value={r.offsetS}
        aria-label="Position in the take"
        aria-valuetext={`${duration(r.offsetS)} of ${duration(r.durationS)}`}
        data-testid="seek"
        onInput={(event) => seek(Number(event.currentTarget.value))}
      />
      <label class="speed">
        <span class="visually-hidden">Speed</span>
        <select data-testid="speed" value={String(r.speed)} onChange={(event) => setSpeed(Number(event.currentTarget.value))}>
          {SPEEDS.map((speed) => (
            <option key={speed} value={String(speed)}>
              {speed}×
            </option>
          ))}
        </select>
      </label>
      <button type="button" class="primary" data-testid="back-to-live" aria-keyshortcuts="Escape" onClick={closeReplay}>
        Back to live <kbd>Esc</kbd>
      </button>
      {r.state === "failed" && (
        <p class="transport-trouble" role="alert" data-testid="replay-trouble">
          ▲ {r.trouble}
        </p>
      )}
    </section>
  );
}
