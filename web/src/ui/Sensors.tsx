// One card per sensor: its state in words, its figures, and what to do when something is wrong.

import { SensorState, type SensorStatus } from "../gen/posefuse/v1/room_pb";
import { count, fixed, offset } from "../model/format";
import { colourOf, connection, liveSensors, sensors, status } from "../state/store";

const STATES: Record<SensorState, { word: string; icon: string; kind: string; name: string }> = {
  [SensorState.LIVE]: { word: "Live", icon: "●", kind: "ok", name: "live" },
  [SensorState.STALLED]: { word: "Stalled", icon: "▲", kind: "warn", name: "stalled" },
  [SensorState.DISCONNECTED]: { word: "Disconnected", icon: "✕", kind: "bad", name: "disconnected" },
  [SensorState.UNSPECIFIED]: { word: "Unknown", icon: "?", kind: "muted", name: "unknown" },
};

export function Sensors() {
  const list = sensors.value;
  return (
    <section class="panel sensors" aria-labelledby="sensors-title">
      <header class="panel-head">
        <h2 id="sensors-title">Sensors</h2>
        <span class="muted tabular">{list.length > 0 && connection.value.kind === "online" ? `${liveSensors.value} of ${list.length} live` : ""}</span>
      </header>
      <p class="visually-hidden" role="status">
        {list.filter((s) => s.state !== SensorState.LIVE).map((s) => `Sensor ${s.info?.name}: ${STATES[s.state]?.word}. ${s.trouble}`).join(" ")}
      </p>
      {list.length === 0 && <p class="panel-empty">{status.value ? "None has joined yet." : "Waiting for the server."}</p>}
      <ul class="cards">
        {list.map((sensor) => (
          <SensorCard key={sensor.info?.name} sensor={sensor} />
        ))}
      </ul>
    </section>
  );
}

function SensorCard({ sensor }: { sensor: SensorStatus }) {
  const told = connection.value.kind === "online" ? sensor.state : SensorState.UNSPECIFIED;
  const state = STATES[told] ?? STATES[SensorState.UNSPECIFIED];
  const name = sensor.info?.name ?? "";
  const gone = told !== SensorState.LIVE;
  const refused = Object.entries(sensor.rejected).filter(([, n]) => n > 0n);
  return (
    <li class={`card ${gone ? "gone" : ""}`} data-testid="sensor-card" data-sensor={name} data-state={state.name} aria-label={`Sensor ${name}, ${state.word}`}>
      <div class="card-head">
        <span class={`swatch sensor-colour-${colourOf(name)}`} aria-hidden="true" />
        <h3 title={name}>{name}</h3>
        <span class={`state ${state.kind}`}>
          <span aria-hidden="true">{state.icon}</span> {state.word}
        </span>
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
      <dl class="card-figures">
        <Cell name="Rate" value={fixed(sensor.framesPerSecond, 1, "fps")} />
        <Cell name="Latency" value={fixed(sensor.latencyMs, (sensor.latencyMs ?? 0) < 100 ? 1 : 0, "ms")} />
        <Cell name="Residual" value={fixed(gone ? undefined : sensor.residualMm, 0, "mm")} title="Median distance of this sensor's joints to the fused ones" />
        <Cell name="Bodies" value={String(sensor.bodies)} />
        <Cell name="Lost" value={count(sensor.framesLost)} title="Frames missing in the sequence numbers" alert={sensor.framesLost > 0n} />
        <Cell name="Agent drops" value={sensor.agentDropped === undefined ? "–" : count(sensor.agentDropped)} title="Frames the agent itself had to drop" alert={(sensor.agentDropped ?? 0n) > 0n} />
        <Cell name="Clock" wide value={offset(sensor.clockOffsetMs, sensor.clockErrorMs)} title={`Agent clock minus server clock; drift ${fixed(sensor.clockDriftPpm, 1, "ppm")}`} />
      </dl>
      {refused.length > 0 && (
        <details class="card-refused">
          <summary>{count(refused.reduce((sum, [, n]) => sum + n, 0n))} refused</summary>
          <ul>
            {refused.map(([reason, n]) => (
              <li key={reason}>
                {reason}: {count(n)}
              </li>
            ))}
          </ul>
        </details>
      )}
    </li>
  );
}

function Cell(props: { name: string; value: string; title?: string; wide?: boolean; alert?: boolean }) {
  return (
    <div class={`${props.wide ? "wide" : ""} ${props.alert ? "alert" : ""}`} title={props.title}>
      <dt>{props.name}</dt>
      <dd>{props.value}</dd>
    </div>
  );
}
