// Planning beside the 3D view: what the sensors see, who disturbs whom, where the next one should stand, and sensors
// that are only planned.

import { useState } from "preact/hooks";
import { areaSeen, LAYER_WORDS, layerOf, LAYERS, pairOf } from "../../model/plan";
import { fixed, plural } from "../../model/format";
import { addSuggested, MAX_PLANNED, place, plan, planArea, planBusy, planLayer, planModel, planOpen, planRoom, planRows, planTrouble, roomHasSensors } from "../../state/plan";
import { AreaFields } from "./AreaFields";
import { Rows } from "./Rows";

export function PlanPanel() {
  return (
    <section class="panel plan" aria-labelledby="plan-title" data-testid="plan-panel" data-busy={planBusy.value}>
      <header class="panel-head">
        <h2 id="plan-title">Plan the room</h2>
        <button type="button" onClick={() => (planOpen.value = false)} data-testid="plan-close">
          Close
        </button>
      </header>
      <div class="panel-body">
        {planTrouble.value && (
          <p class="card-trouble bad" role="alert" data-testid="plan-trouble">
            {planTrouble.value}
          </p>
        )}
        <Coverage />
        <Next />
        <Sensors />
        <Pairs />
        <Notes />
      </div>
    </section>
  );
}

function Coverage() {
  const found = plan.value;
  const layer = found && layerOf(found, planLayer.value);
  return (
    <section class="plan-part" aria-labelledby="plan-coverage">
      <h3 id="plan-coverage">What is seen</h3>
      <div class="segmented" role="group" aria-label="Seen where">
        {LAYERS.map((choice) => (
          <button
            key={choice} type="button" aria-pressed={planLayer.value === choice} data-testid={`plan-layer-${choice}`}
            title={choice === "whole" ? "A standing person, from head to foot" : `At ${LAYER_WORDS[choice]} above the floor`} onClick={() => (planLayer.value = choice)}
          >
            {LAYER_WORDS[choice]}
          </button>
        ))}
      </div>
      <dl class="plan-shares">
        {["One or more", "Two or more", "Three or more"].map((words, i) => (
          <div key={words}>
            <dt>{words}</dt>
            <dd data-testid={`plan-share-${i + 1}`}>{layer ? fixed(100 * (layer.shares[i] ?? 0), 0, "%") : "–"}</dd>
            <dd class="muted">{found && layer ? fixed(areaSeen(found, layer, i + 1), 1, "m²") : "–"}</dd>
          </div>
        ))}
        <div title="Two sensors see a whole person from directions at least 60 degrees apart">
          <dt>Two from different sides</dt>
          <dd data-testid="plan-crossed">{found ? fixed(100 * found.crossedShare, 0, "%") : "–"}</dd>
          <dd class="muted" />
        </div>
      </dl>
      <AreaFields />
    </section>
  );
}

function Next() {
  const next = plan.value?.suggestion;
  return (
    <section class="plan-part" aria-labelledby="plan-next">
      <h3 id="plan-next">The next sensor</h3>
      <div class="row">
        <ModelChoice label="Model of the next sensor" value={planModel.value} onChange={(model) => (planModel.value = model)} testid="plan-model" />
        {next && (
          <button type="button" class="primary" data-testid="plan-add" disabled={planRows.value.length >= MAX_PLANNED} onClick={addSuggested}>
            Add it to the plan
          </button>
        )}
      </div>
      <p role="status" data-testid="plan-next-words">{next?.words ?? (plan.value ? "No place adds anything to speak of." : "")}</p>
      <PlaceMany />
    </section>
  );
}

function PlaceMany() {
  const [count, setCount] = useState(4);
  return (
    <form
      class="row"
      onSubmit={(event) => {
        event.preventDefault();
        void place(count);
      }}
    >
      <button type="submit" data-testid="plan-place" disabled={planBusy.value}>
        Place
      </button>
      <input type="number" min={1} max={8} value={count} aria-label="How many sensors to place" data-testid="plan-count" onInput={(e) => setCount(Math.min(Math.max(e.currentTarget.valueAsNumber || 1, 1), 8))} />
      <span>in the best places</span>
    </form>
  );
}

export function ModelChoice(props: { label: string; value: string; onChange(model: string): void; testid?: string }) {
  const models = plan.value?.models ?? [];
  const known = models.includes(props.value) ? models : [props.value, ...models];
  return (
    <select aria-label={props.label} value={props.value} data-testid={props.testid} onChange={(e) => props.onChange(e.currentTarget.value)}>
      {known.map((model) => (
        <option key={model}>{model}</option>
      ))}
    </select>
  );
}

function Sensors() {
  return (
    <section class="plan-part" aria-labelledby="plan-sensors">
      <h3 id="plan-sensors">Sensors</h3>
      <label class="check">
        <input type="checkbox" data-testid="plan-room" checked={planRoom.value && roomHasSensors.value} disabled={!roomHasSensors.value} onChange={(e) => (planRoom.value = e.currentTarget.checked)} />
        {roomHasSensors.value ? "Count the room's own sensors" : "The room has no calibrated sensor to count"}
      </label>
      <Rows />
    </section>
  );
}

function Pairs() {
  const pairs = (plan.value?.interferences ?? []).map(pairOf);
  return (
    <section class="plan-part" aria-labelledby="plan-pairs">
      <h3 id="plan-pairs">Interference</h3>
      {pairs.length === 0 && <p class="muted">{(plan.value?.sensors.length ?? 0) < 2 ? "It takes two sensors." : "No pair disturbs each other."}</p>}
      <ul class="plan-pairs">
        {pairs.map((pair) => (
          <li key={`${pair.a} ${pair.b}`} data-testid="plan-pair" data-severity={pair.strong ? "strong" : "mild"}>
            <strong>
              {pair.a} and {pair.b}
            </strong>{" "}
            <span class={`badge ${pair.strong ? "bad" : "muted"}`}>{pair.strong ? "strong" : "mild"}</span> <span class="muted">{fixed(100 * pair.share, 0, "% of a view")}</span>
            <p>{pair.advice}.</p>
          </li>
        ))}
      </ul>
    </section>
  );
}

function Notes() {
  const notes = plan.value?.notes ?? [];
  return (
    <section class="plan-part plan-notes" aria-label="Notes">
      {notes.map((note) => (
        <p key={note}>{note}</p>
      ))}
      <p class="muted">
        {plan.value && `Of ${plural(plan.value.sensors.length, "sensor", "sensors")}, ${planArea.value ? "in the area given" : "in 4 m by 4 m about where they look"}. `}
        The room is taken to be empty: people and furniture hide what is behind them, so two sensors that see a person from different sides are worth more than two from one side.
      </p>
    </section>
  );
}
