// Every sensor's part in every joint: joints down, sensors across, so that the one that hurts stands out as a column.

import type { Contribution } from "../../gen/posefuse/v1/room_pb";
import { fixed } from "../../model/format";
import { figure, fill, heatOf, jointParts, QUANTITIES, type Quantity } from "../../model/contribution";
import { jointLabel } from "../../model/figure";
import { JOINT_NAMES } from "../../model/joints";
import { quantity } from "../../state/prefs";
import { harms, mute, muting } from "../../state/sensors";
import { colourOf, sensors } from "../../state/store";
import { Bar } from "../Bar";
import { Modal } from "../Modal";
import { QuantityChoice } from "./JointFigure";

export function WeightsDialog() {
  return (
    <Modal name="weights" title="Each sensor's part in the fused people" wide>
      <Matrix />
    </Modal>
  );
}

function Matrix() {
  const shown = quantity.value;
  const list = sensors.value.map((s) => ({ sensor: s, name: s.info?.name ?? "", parts: jointParts(s.muted ? undefined : s.contribution) }));
  const none = list.every(({ sensor }) => sensor.contribution === undefined);
  return (
    <>
      <div class="row matrix-head">
        <QuantityChoice />
        <p class="muted">
          {QUANTITIES[shown].title}, {QUANTITIES[shown].unit}. {none ? "Nobody is seen, so there is nothing to tell." : ""}
        </p>
      </div>
      <div class="table-scroll matrix-scroll" tabIndex={0} role="group" aria-label="Joints and sensors, a table that scrolls">
        <table class="figures-table matrix" data-testid="matrix">
          <thead>
            <tr>
              <th scope="col">Joint</th>
              {list.map(({ name, sensor }) => (
                <th key={name} scope="col">
                  <span class="matrix-name">
                    <span class={`swatch sensor-colour-${colourOf(name)} ${sensor.muted ? "hollow" : ""}`} aria-hidden="true" />
                    <span>{name}</span>
                  </span>
                  <button type="button" class="small" aria-pressed={sensor.muted} aria-label={`${sensor.muted ? "Unmute" : "Mute"} ${name}`} disabled={muting.value.has(name)} onClick={() => void mute(name, !sensor.muted)}>
                    {sensor.muted ? "Unmute" : "Mute"}
                  </button>
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            <tr class="matrix-all">
              <th scope="row">All joints</th>
              {list.map(({ name, sensor }) => (
                <Heat key={name} quantity={shown} value={sensor.muted ? null : overall(shown, sensor.contribution)} note={!sensor.muted && harms.value.has(name) ? "hurts" : sensor.muted ? "muted" : ""} />
              ))}
            </tr>
            {JOINT_NAMES.map((joint, i) => (
              <tr key={joint}>
                <th scope="row">{jointLabel(joint)}</th>
                {list.map(({ name, parts }) => (
                  <Heat key={name} quantity={shown} value={parts[i]![shown]} />
                ))}
              </tr>
            ))}
          </tbody>
          <tfoot>
            <tr>
              <th scope="row">Latency</th>
              {list.map(({ name, sensor }) => (
                <td key={name} class="heat">
                  {fixed(sensor.latencyMs, 0, "ms")}
                </td>
              ))}
            </tr>
          </tfoot>
        </table>
      </div>
    </>
  );
}

function overall(shown: Quantity, part: Contribution | undefined): number | null {
  if (!part) return null;
  return shown === "weight" ? part.weight : shown === "rejected" ? part.rejectedShare : (part.residualMm ?? null);
}

function Heat({ quantity: shown, value, note }: { quantity: Quantity; value: number | null; note?: string }) {
  return (
    <td class={`heat heat-${heatOf(shown, value)}`}>
      <Bar share={fill(shown, value)} />
      <span class="tabular">{figure(shown, value)}</span>
      {note && <strong> {note}</strong>}
    </td>
  );
}
