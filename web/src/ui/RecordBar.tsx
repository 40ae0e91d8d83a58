// Recording: the take's name, slate and notes, one button, the running time.

import { duration } from "../model/format";
import { secondsOf } from "../model/frame";
import { connection, status, statusAt } from "../state/store";
import { takeBusy, takeForm, toggleRecording, type TakeForm } from "../state/takes";
import { useNow } from "./Banners";

export function RecordBar() {
  const online = connection.value.kind === "online";
  const last = status.value?.recording;
  const recording = online ? last : undefined;
  const canRecord = status.value !== null && online && !takeBusy.value;
  return (
    <section class={recording ? "transport recording" : "transport"} aria-label="Recording" data-testid="record-bar">
      <button
        type="button"
        class={recording ? "record on" : "record"}
        data-testid="record-button"
        aria-keyshortcuts="r"
        aria-pressed={recording !== undefined}
        disabled={!canRecord}
        onClick={() => void toggleRecording()}
      >
        <span class="record-dot" aria-hidden="true" />
        {recording ? "Stop" : "Record"} <kbd>R</kbd>
      </button>
      {recording ? (
        <div class="running" role="status">
          <strong>REC</strong>
          <RunningTime />
          <span class="running-name" data-testid="rec-name">{recording.name}</span>
          {recording.slate && <span>slate {recording.slate}</span>}
          {recording.dropped > 0n && <span class="warn-text">▲ {String(recording.dropped)} inputs dropped</span>}
          {recording.trouble && <span class="warn-text">▲ {recording.trouble}</span>}
        </div>
      ) : last ? (
        <div class="running muted" role="status" data-testid="rec-lost">
          was recording <span class="running-name">{last.name}</span> when the server went away
        </div>
      ) : (
        <div class="fields">
          <Field name="name" label="Take" placeholder="date and time" title="A name that exists gets a number appended" />
          <Field name="slate" label="Slate" placeholder="" />
          <Field name="notes" label="Notes" placeholder="" />
        </div>
      )}
    </section>
  );
}

function Field(props: { name: keyof TakeForm; label: string; placeholder: string; title?: string }) {
  return (
    <label class={`field field-${props.name}`} title={props.title}>
      <span>{props.label}</span>
      <input
        type="text"
        autocomplete="off"
        spellcheck={false}
        maxLength={props.name === "notes" ? 2000 : 120}
        placeholder={props.placeholder}
        data-testid={`take-${props.name}`}
        value={takeForm.value[props.name]}
        onInput={(event) => (takeForm.value = { ...takeForm.value, [props.name]: event.currentTarget.value })}
        onKeyDown={(event) => {
          if (event.key !== "Enter" || event.isComposing) return;
          event.preventDefault();
          void toggleRecording();
        }}
      />
    </label>
  );
}

/** Counts on between two reports of the server. */
function RunningTime() {
  useNow(100);
  const s = status.value;
  if (!s?.recording) return null;
  const since = (performance.now() - statusAt.value) / 1000;
  const civil = secondsOf(s.timeNs + s.unixOffsetNs) - Date.parse(s.recording.started) / 1000;
  const base = Number.isFinite(civil) && civil >= 0 ? civil : secondsOf(s.recording.durationNs);
  return (
    <span class="running-time" role="timer" data-testid="rec-time">
      {duration(base + since, true)}
    </span>
  );
}
