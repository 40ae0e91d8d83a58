// One sensor: its state in words, its figures, its part in the fused people, and what to do when something is wrong.

import { useState } from "preact/hooks";
import { SensorState, type SensorStatus } from "../../gen/posefuse/v1/room_pb";
import { explainDrift } from "../../model/drift";
import { count, fixed, offset } from "../../model/format";
import { depthOpen, toggleDepth } from "../../state/depth";
import { harms, mute, muting } from "../../state/sensors";
import { colourOf, connection } from "../../state/store";
import { Bar } from "../Bar";
import { RecalibrateButton } from "./Alarms";
import { DepthPanel } from "./Depth";
import { JointFigure } from "./JointFigure";
import { STATES } from "./states";

export function SensorCard({ sensor }: { sensor: SensorStatus }) {
  const told = connection.value.kind === "online" ? sensor.state : SensorState.UNSPECIFIED;
  const state = STATES[told] ?? STATES[SensorState.UNSPECIFIED];
  const name = sensor.info?.name ?? "";
  const gone = told !== SensorState.LIVE;
  const [more, setMore] = useState(false);
  const depth = depthOpen.value.has(name);
  const harm = sensor.muted || gone ? "" : (harms.value.get(name) ?? "");
  return (
    <li
      class={`card ${gone ? "gone" : ""} ${sensor.muted ? "muted-sensor" : ""}`}
      data-testid="sensor-card" data-sensor={name} data-state={state.name} data-muted={sensor.muted} data-hurts={harm !== ""}
      aria-label={`Sensor ${name}, ${state.word}${sensor.muted ? ", muted" : ""}`}
    >
      <div class="card-head">
        <span class={`swatch sensor-colour-${colourOf(name)} ${sensor.muted ? "hollow" : ""}`} aria-hidden="true" />
        <h3 title={name}>{name}</h3>
        {sensor.muted && <span class="badge muted" data-testid="muted-badge">Muted</span>}
        <span class={`state ${state.kind}`}>
          <span aria-hidden="true">{state.icon}</span> {state.word}
        </span>
        <button
          type="button" class="small mute" aria-pressed={sensor.muted} aria-label={`${sensor.muted ? "Unmute" : "Mute"} ${name}`} data-testid="mute"
          title={sensor.muted ? "Take it into fusing again" : "Leave it out of fusing; it is still recorded and shown"}
          disabled={muting.value.has(name) || connection.value.kind !== "online"} onClick={() => void mute(name, !sensor.muted)}
        >
          {sensor.muted ? "Unmute" : "Mute"}
        </button>
      </div>
      <p class="card-model">
        {sensor.info?.model || "Unnamed model"}
        <span class={sensor.calibrated ? "calibrated" : "calibrated no"}>{sensor.calibrated ? "calibrated" : "not calibrated"}</span>
      </p>
      {sensor.trouble && (
        <p class={`card-trouble ${state.kind === "bad" ? "bad" : "warn"}`} data-testid="sensor-trouble">
          {sensor.trouble}
        </p>
      )}
      {sensor.drift?.alarm && <RecalibrateButton sensor={name} kind="primary card-repair" />}
      {harm && (
        <p class="card-trouble bad" data-testid="sensor-harm">
          <strong>This sensor hurts:</strong> {harm}.
        </p>
      )}
      <Figures sensor={sensor} gone={gone} />
      <Weight sensor={sensor} gone={gone} />
      <div class="card-clock">
        <span title={`Agent clock minus server clock; drift ${fixed(sensor.clockDriftPpm, 1, "ppm")}`}>
          <span class="weight-name">Clock</span> <span class="tabular">{offset(sensor.clockOffsetMs, sensor.clockErrorMs)}</span>
        </span>
        <span class="card-buttons">
          <button
            type="button" class="quiet small" aria-expanded={depth} aria-label={`Depth of ${name}`} data-testid="depth-button"
            title={sensor.depthPreview ? "What the sensor sees" : "This sensor has no depth to show"} onClick={() => toggleDepth(name)}
          >
            Depth <span aria-hidden="true">{depth ? "▴" : "▾"}</span>
          </button>
          <button type="button" class="quiet small" aria-expanded={more} aria-label={`More of ${name}`} data-testid="more" onClick={() => setMore(!more)}>
            More <span aria-hidden="true">{more ? "▴" : "▾"}</span>
          </button>
        </span>
      </div>
      {depth && <DepthPanel sensor={sensor} />}
      {more && <More sensor={sensor} />}
    </li>
  );
}

function Figures({ sensor, gone }: { sensor: SensorStatus; gone: boolean }) {
  const agentDrops = sensor.agentDropped ?? 0n;
  const lost = sensor.framesLost + agentDrops;
  const moved = gone ? undefined : sensor.drift;
  return (
    <dl class="card-figures">
      <Cell name="Rate" value={fixed(sensor.framesPerSecond, 1, "fps")} />
      <Cell name="Latency" value={fixed(sensor.latencyMs, (sensor.latencyMs ?? 0) < 100 ? 1 : 0, "ms")} />
      <Cell name="Residual" value={fixed(gone ? undefined : sensor.residualMm, 0, "mm")} title="Median distance of this sensor's joints to the fused ones" />
      <Cell name="Bodies" value={String(sensor.bodies)} />
      <Cell
        name="Lost" value={count(lost)} alert={lost > 0n}
        title={`${count(sensor.framesLost)} frames missing in the sequence numbers, ${sensor.agentDropped === undefined ? "an unknown number" : count(agentDrops)} dropped by the agent itself`}
      />
      <Cell name="Moved" value={fixed(moved?.movedMm, 0, "mm")} title={explainDrift(moved)} alert={moved?.alarm ?? false} />
    </dl>
  );
}

/** The row is there before anything is known, so that nothing jumps. */
function Weight({ sensor, gone }: { sensor: SensorStatus; gone: boolean }) {
  const part = gone || sensor.muted ? undefined : sensor.contribution;
  const percent = (share: number | undefined) => fixed(share === undefined ? undefined : 100 * share, 0, "%");
  const title = "Its share of the weight in the joints it sees, and how much of what it measures contradicts the others and is ignored";
  return (
    <div class="weight" title={title} data-testid="weight" data-weight={part?.weight}>
      <span class="weight-name">Weight</span>
      <Bar share={part?.weight ?? 0} />
      <span class="weight-value">{percent(part?.weight)}</span>
      <span class={part && part.rejectedShare >= 0.1 ? "weight-ignored alert" : "weight-ignored"}>{percent(part?.rejectedShare)} ignored</span>
    </div>
  );
}

function More({ sensor }: { sensor: SensorStatus }) {
  const refused = Object.entries(sensor.rejected).filter(([, n]) => n > 0n);
  return (
    <div class="more">
      <JointFigure sensor={sensor} />
      <h4>Refused</h4>
      {refused.length === 0 ? (
        <p class="muted">No frame and no joint.</p>
      ) : (
        <ul>
          {refused.map(([reason, n]) => (
            <li key={reason}>
              {reason}: {count(n)}
            </li>
          ))}
        </ul>
      )}
      <h4>Place</h4>
      <p>{explainDrift(sensor.drift)}.</p>
      <p class="muted">To find its place anew, walk about for 20 s in its view, then:</p>
      <RecalibrateButton sensor={sensor.info?.name ?? ""} />
    </div>
  );
}

function Cell(props: { name: string; value: string; title?: string; alert?: boolean }) {
  return (
    <div class={props.alert ? "alert" : ""} title={props.title}>
      <dt>{props.name}</dt>
      <dd>{props.value}</dd>
    </div>
  );
}
