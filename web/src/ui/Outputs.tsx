// Where the fused people go, and what each of them had to drop; what fills in joints that no sensor sees.

import { count } from "../model/format";
import { repairLine } from "../model/repair";
import { status } from "../state/store";

export function Outputs() {
  const sinks = status.value?.sinks ?? [];
  const repair = repairLine(status.value?.repair);
  return (
    <section class="panel" aria-labelledby="outputs-title">
      <header class="panel-head">
        <h2 id="outputs-title">Outputs</h2>
      </header>
      {sinks.length === 0 ? (
        <p class="panel-empty">No output is open.</p>
      ) : (
        <table class="figures-table" data-testid="sinks">
          <thead>
            <tr>
              <th scope="col">Output</th>
              <th scope="col" class="num">Delivered</th>
              <th scope="col" class="num">Dropped</th>
            </tr>
          </thead>
          <tbody>
            {sinks.map((sink) => (
              <tr key={sink.name}>
                <th scope="row">{sink.name}</th>
                <td class="num">{count(sink.delivered)}</td>
                <td class={sink.dropped > 0n ? "num alert" : "num"}>{count(sink.dropped)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
      {repair && (
        <p class={repair.alert ? "repair-line alert" : "repair-line"} data-testid="repair" title={status.value?.repair?.trouble}>
          Repair: {repair.text}
        </p>
      )}
    </section>
  );
}
