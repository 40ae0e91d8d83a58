// Where the fused people go: live outputs as cards with a switch, what is always there as a table, what fills in joints that
// no sensor sees, and what other programs' orders to record came to.

import type { SinkStatus } from "../gen/posefuse/v1/room_pb";
import { count } from "../model/format";
import { secondsOf } from "../model/frame";
import { repairLine } from "../model/repair";
import { canSwitch, sinkFigures, sinkFor, sinkName, sinkState } from "../model/sinks";
import { triggerLines } from "../model/triggers";
import { sinkRates, switching, switchSink } from "../state/sinks";
import { connection, status } from "../state/store";

export function Outputs() {
  const sinks = status.value?.sinks ?? [];
  const live = sinks.filter(canSwitch);
  const always = sinks.filter((sink) => !canSwitch(sink));
  const running = live.filter((sink) => sinkState(sink).on).length;
  const repair = repairLine(status.value?.repair);
  return (
    <section class="panel outputs" aria-labelledby="outputs-title">
      <header class="panel-head">
        <h2 id="outputs-title">Outputs</h2>
        <span class="muted tabular">{live.length > 0 ? `${running} of ${live.length} on` : ""}</span>
      </header>
      <div class="outputs-body">
        {sinks.length === 0 && <p class="panel-empty">No output is open.</p>}
        <ul class="sink-list" data-testid="live-sinks">
          {live.map((sink) => (
            <SinkCard key={sink.name} sink={sink} />
          ))}
        </ul>
        {always.length > 0 && <Always sinks={always} />}
        {repair && (
          <p class={repair.alert ? "repair-line alert" : "repair-line"} data-testid="repair" title={status.value?.repair?.trouble}>
            Repair: {repair.text}
          </p>
        )}
        <Triggers />
      </div>
    </section>
  );
}

function SinkCard({ sink }: { sink: SinkStatus }) {
  const state = sinkState(sink);
  const online = connection.value.kind === "online";
  const name = sinkName(sink);
  const busy = switching.value.has(sink.name);
  const figures = sinkFigures(sink, sinkRates.value.get(sink.name));
  return (
    <li
      class={`sink sink-${state.name}`}
      data-testid="sink-card" data-sink={sink.name} data-state={online ? state.name : "unknown"} data-delivered={String(sink.delivered)}
      aria-label={`Output ${name}, ${online ? state.word : "not known"}`}
    >
      <div class="sink-head">
        <h3 title={sinkFor(sink)}>{name}</h3>
        <span class="sink-place" title={`${sink.place}: ${sinkFor(sink)}`}>{state.on ? "" : sink.place}</span>
        <span class={online ? `state ${state.kind}` : "state muted"} role="status">
          <span aria-hidden="true">{online ? state.icon : "?"}</span> {online ? state.word : "Not known"}
        </span>
        <button
          type="button" role="switch" class="switch" aria-checked={state.on} aria-label={`Send ${name}`} data-testid="sink-switch"
          title={state.on ? "Switch this output off" : "Switch this output on, until the server ends; the configuration says how it begins"}
          disabled={!online || busy} onClick={() => void switchSink(sink.name, !state.on)}
        >
          <span class="knob" aria-hidden="true" />
        </button>
      </div>
      {state.on && <p class="sink-place" title={sinkFor(sink)}>{sink.place}</p>}
      {sink.trouble && <p class="card-trouble bad" role="alert" data-testid="sink-trouble">{sink.trouble}</p>}
      {figures.length > 0 && (
        <dl class={online ? "sink-figures" : "sink-figures stale"}>
          {figures.map((figure) => (
            <div key={figure.name} class={`${figure.alert ? "alert" : ""} ${figure.wide ? "wide" : ""}`} title={figure.title}>
              <dt>{figure.name}</dt>
              <dd>{figure.value}</dd>
            </div>
          ))}
        </dl>
      )}
    </li>
  );
}

function Always({ sinks }: { sinks: SinkStatus[] }) {
  return (
    <table class="figures-table always" data-testid="sinks">
      <thead>
        <tr>
          <th scope="col">Always there</th>
          <th scope="col" class="num">Delivered</th>
          <th scope="col" class="num">Dropped</th>
        </tr>
      </thead>
      <tbody>
        {sinks.map((sink) => (
          <tr key={sink.name} title={sinkFor(sink)}>
            <th scope="row">{sinkName(sink)}</th>
            <td class="num">{count(sink.delivered)}</td>
            <td class={sink.dropped > 0n ? "num alert" : "num"}>{count(sink.dropped)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

function Triggers() {
  const s = status.value;
  if (!s) return null;
  const lines = triggerLines(s.triggers, 1000 * secondsOf(s.timeNs + s.unixOffsetNs));
  return (
    <>
      {lines.map((line) => (
        <p key={line.key} class={line.alert ? "repair-line alert" : "repair-line"} data-testid="trigger" title={line.place}>
          {line.name} trigger: {line.text}
        </p>
      ))}
    </>
  );
}
