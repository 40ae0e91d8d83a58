// What the operator must know now: no server, the room's troubles, a sensor that moved; and short notices that pass.

import { useEffect, useState } from "preact/hooks";
import { retryNow } from "../state/live";
import { connection, dismiss, notices, status } from "../state/store";
import { Alarms } from "./sensors/Alarms";

export function Banners() {
  const c = connection.value;
  return (
    <div class="banners">
      {c.kind === "offline" && <Offline reason={c.reason} retryAtMs={c.retryAtMs} />}
      {c.kind === "online" && (status.value?.troubles ?? []).map((text) => (
        <div class="banner warn" role="alert" data-testid="trouble" key={text}>
          <span class="icon" aria-hidden="true">▲</span>
          <span class="text">{text}</span>
        </div>
      ))}
      {c.kind === "online" && <Alarms />}
    </div>
  );
}

function Offline(props: { reason: string; retryAtMs: number | null }) {
  const now = useNow(500);
  const left = props.retryAtMs === null ? 0 : Math.max(0, Math.ceil((props.retryAtMs - now) / 1000));
  return (
    <div class="banner bad" data-testid="offline">
      <span class="icon" aria-hidden="true">✕</span>
      <span role="alert">
        <strong>The server does not answer.</strong> {props.reason} All figures are from before. A take it was
        recording is recovered when it starts again.
      </span>
      <span class="grow" />
      <span class="tabular">{props.retryAtMs === null ? "Trying now …" : `Trying again in ${left} s`}</span>
      <button type="button" onClick={retryNow}>
        Try now
      </button>
    </div>
  );
}

/** Renders anew every `ms`; gives the civil time, ms. */
export function useNow(ms: number): number {
  const [now, setNow] = useState(Date.now());
  useEffect(() => {
    const timer = setInterval(() => setNow(Date.now()), ms);
    return () => clearInterval(timer);
  }, [ms]);
  return now;
}

export function Notices() {
  return (
    <div class="notices" aria-live="polite">
      {notices.value.map((n) => (
        <div key={n.id} class={n.kind === "error" ? "notice is-error" : "notice"} role={n.kind === "error" ? "alert" : undefined} data-testid={`notice-${n.kind}`}>
          <span>{n.text}</span>
          <button type="button" class="quiet" aria-label="Dismiss" onClick={() => dismiss(n.id)}>
            ✕
          </button>
        </div>
      ))}
    </div>
  );
}
