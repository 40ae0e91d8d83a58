// The list of takes, newest first; one can be replayed, and its slate and notes changed.

import { useState } from "preact/hooks";
import { TakeState, type Take } from "../gen/posefuse/v1/room_pb";
import { bytes, count, dateTime, duration, exportLine, plural } from "../model/format";
import { secondsOf } from "../model/frame";
import { openReplay } from "../state/replay";
import { connection, replay, status, takes, takesTrouble } from "../state/store";
import { updateTake } from "../state/takes";
import { Command } from "./Command";

const STATES: Record<TakeState, { word: string; kind: string }> = {
  [TakeState.COMPLETE]: { word: "Complete", kind: "muted" },
  [TakeState.RECORDING]: { word: "Recording", kind: "rec" },
  [TakeState.RECOVERED]: { word: "Recovered", kind: "warn" },
  [TakeState.DAMAGED]: { word: "Damaged", kind: "bad" },
  [TakeState.UNSPECIFIED]: { word: "Unknown", kind: "muted" },
};

export function Takes() {
  const list = takes.value;
  return (
    <section class="panel takes" aria-labelledby="takes-title">
      <header class="panel-head">
        <h2 id="takes-title">Takes</h2>
        <span class="muted tabular">{list.length > 0 ? list.length : ""}</span>
      </header>
      {takesTrouble.value && connection.value.kind === "online" && <p class="card-trouble warn" role="alert">{takesTrouble.value}</p>}
      {list.length === 0 && !takesTrouble.value && <p class="panel-empty">Nothing recorded yet. Press R to record.</p>}
      <ul class="take-list" data-testid="takes">
        {list.map((take) => (
          <TakeRow key={take.name} take={take} />
        ))}
      </ul>
    </section>
  );
}

function TakeRow({ take }: { take: Take }) {
  const state = STATES[take.state] ?? STATES[TakeState.UNSPECIFIED];
  const shown = replay.value?.take.name === take.name;
  const recording = take.state === TakeState.RECORDING;
  const lost = recording && connection.value.kind === "offline";
  const readable = !recording && take.state !== TakeState.DAMAGED;
  const sensorList = take.sensors.join(", ");
  return (
    <li class={shown ? "take shown" : "take"} data-testid="take-row" data-take={take.name} data-state={state.word.toLowerCase()}>
      <div class="take-head">
        <h3 title={take.name}>{take.name}</h3>
        {take.state !== TakeState.COMPLETE && <span class={`badge ${lost ? "muted" : state.kind}`}>{lost ? "Not ended" : state.word}</span>}
        <button type="button" data-testid="replay-button" aria-label={`Replay ${take.name}`} disabled={!readable || shown || connection.value.kind !== "online"} onClick={() => openReplay(take)}>
          {shown ? "Shown" : "Replay"}
        </button>
      </div>
      <p class="take-facts tabular">
        <span>{dateTime(take.started)}</span>
        {readable && <span>{duration(secondsOf(take.durationNs), true)}</span>}
        {readable && <span>{plural(take.people, "person", "people")}</span>}
        {take.sensors.length > 0 && <span title={sensorList}>{plural(take.sensors.length, "sensor")}</span>}
        {!recording && <span>{bytes(take.sizeBytes)}</span>}
        {take.timecode && <span title={`Timecode of its start, ${take.timecodeRate} frames a second`}>TC {take.timecode}</span>}
        {take.slate && <span>slate {take.slate}</span>}
      </p>
      {take.dropped > 0n && <p class="warn-text">▲ {count(take.dropped)} inputs did not reach the file</p>}
      {take.trouble && <p class={state.kind === "bad" ? "card-trouble bad" : "card-trouble warn"}>{take.trouble}</p>}
      {!recording && <Words take={take} />}
      {readable && <Export take={take} />}
    </li>
  );
}

const PRESETS = ["blender", "unity", "unreal", "motionbuilder", "mixamo", "opensim", "kinect"];

/** Files are written by the program beside the takes, not by the browser: this says how. */
function Export({ take }: { take: Take }) {
  const [preset, setPreset] = useState("");
  if (!preset) {
    return (
      <button type="button" class="quiet small" data-testid="export-button" aria-label={`Export ${take.name}`} onClick={() => setPreset("blender")}>
        Export
      </button>
    );
  }
  const line = exportLine(take.name, preset, status.value?.takeFolder ?? "");
  return (
    <div class="take-export">
      <label>
        Files for{" "}
        <select value={preset} onChange={(e) => setPreset(e.currentTarget.value)}>
          {PRESETS.map((name) => <option key={name} value={name}>{name}</option>)}
        </select>
      </label>
      <p class="muted">Run this where the server runs:</p>
      <Command lines={line} name="export-command" />
      <button type="button" class="quiet small" onClick={() => setPreset("")}>Close</button>
    </div>
  );
}

function Words({ take }: { take: Take }) {
  const [editing, setEditing] = useState<{ slate: string; notes: string } | null>(null);
  if (!editing) {
    return (
      <div class="take-notes">
        {take.notes && <p>{take.notes}</p>}
        <button type="button" class="quiet small" aria-label={`Edit slate and notes of ${take.name}`} onClick={() => setEditing({ slate: take.slate, notes: take.notes })}>
          {take.notes || take.slate ? "Edit notes" : "Add notes"}
        </button>
      </div>
    );
  }
  const save = async (event: Event) => {
    event.preventDefault();
    if (await updateTake(take.name, editing)) setEditing(null);
  };
  return (
    <form class="take-edit" onSubmit={(event) => void save(event)} onKeyDown={(event) => event.key === "Escape" && (event.preventDefault(), setEditing(null))}>
      <label>
        Slate
        <input type="text" value={editing.slate} onInput={(e) => setEditing({ ...editing, slate: e.currentTarget.value })} />
      </label>
      <label>
        Notes
        <textarea rows={3} value={editing.notes} onInput={(e) => setEditing({ ...editing, notes: e.currentTarget.value })} />
      </label>
      <div class="row">
        <button type="submit" class="primary">
          Save
        </button>
        <button type="button" onClick={() => setEditing(null)}>
          Cancel
        </button>
      </div>
    </form>
  );
}
