// The sensors, one card each.

import { SensorState } from "../../gen/posefuse/v1/room_pb";
import { connection, dialog, liveSensors, sensors, status } from "../../state/store";
import { SensorCard } from "./Card";
import { STATES } from "./states";

export function Sensors() {
  const list = sensors.value;
  return (
    <section class="panel sensors" aria-labelledby="sensors-title">
      <header class="panel-head">
        <h2 id="sensors-title">Sensors</h2>
        <span class="muted tabular">{list.length > 0 && connection.value.kind === "online" ? `${liveSensors.value} of ${list.length} live` : ""}</span>
        <button type="button" class="quiet small" data-testid="weights-button" disabled={list.length === 0} title="Every sensor's part in every joint" onClick={() => (dialog.value = "weights")}>
          Weights …
        </button>
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
