// The status bar: what the room does at this moment, in one line.

import { bytes, fixed } from "../model/format";
import { resolvedTheme, toggleTheme } from "../state/prefs";
import { Timecode } from "./Timecode";
import { connection, dialog, liveSensors, replay, sensors, status } from "../state/store";

function Figure(props: { name: string; value: string; title: string; testid?: string }) {
  return (
    <div class="figure" title={props.title}>
      <dt>{props.name}</dt>
      <dd data-testid={props.testid}>{props.value}</dd>
    </div>
  );
}

export function TopBar() {
  const s = status.value;
  const latency = s ? `${fixed(s.latencyP50Ms, 1)} / ${fixed(s.latencyP99Ms, 1, "ms")}` : "–";
  const online = connection.value.kind === "online";
  return (
    <header class="topbar">
      <h1 class="brand">
        <Mark />
        Posefuse
      </h1>
      <Connection />
      {online && s?.recording && replay.value && <span class="badge rec" role="status">REC {s.recording.name}</span>}
      <dl class={online ? "figures" : "figures stale"}>
        <Figure name="Sensors" value={s ? `${liveSensors.value}/${sensors.value.length}` : "–"} title="Sensors that deliver, of those known" testid="figure-sensors" />
        <Figure name="People" value={s ? String(s.people) : "–"} title="People in the room now" testid="figure-people" />
        <Figure name="Fused" value={s ? fixed(s.framesPerSecond, 1, "fps") : "–"} title="Fused frames per second" testid="figure-fps" />
        <Figure name="Engine" value={s ? fixed(s.engineUs, 0, "µs") : "–"} title="Time the engine spends on one fused frame" />
        <Figure name="Latency p50/p99" value={latency} title="From a frame's arrival at the server to its subscribers" />
        <Timecode />
        <Figure name="Disk free" value={s ? bytes(s.diskFreeBytes) : "–"} title={s ? `Where takes go: ${s.takeFolder}` : ""} />
      </dl>
      <div class="tools">
        <button type="button" class="quiet" data-testid="theme" aria-label={`Change to the ${resolvedTheme.value === "dark" ? "light" : "dark"} theme`} onClick={toggleTheme}>
          {resolvedTheme.value === "dark" ? "Light" : "Dark"}
        </button>
        <button type="button" class="quiet" data-testid="config" onClick={() => (dialog.value = "config")}>
          Settings
        </button>
        <button type="button" class="quiet" data-testid="help" aria-keyshortcuts="?" onClick={() => (dialog.value = "help")}>
          Keys <kbd>?</kbd>
        </button>
      </div>
    </header>
  );
}

function Connection() {
  const c = connection.value;
  const word = c.kind === "online" ? (replay.value ? "Replay" : "Live") : c.kind === "offline" ? "Offline" : "Connecting";
  const kind = c.kind === "online" ? (replay.value ? "info" : "ok") : c.kind === "offline" ? "bad" : "muted";
  return (
    <span class={`badge ${kind}`} role="status" data-testid="connection" data-state={c.kind}>
      {word}
    </span>
  );
}

function Mark() {
  return (
    <svg class="mark" viewBox="0 0 24 24" aria-hidden="true">
      <circle cx="12" cy="4.6" r="2.6" />
      <path d="M12 9v6.4M5.5 9.6 12 10.6l6.5-1M12 15.2 8 21.5M12 15.2l4 6.3" />
    </svg>
  );
}
