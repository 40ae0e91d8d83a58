// The room's timecode, running. It is written straight into the page at each of the screen's frames: rendering sixty times a
// second would cost more than all the rest.

import { useEffect, useRef } from "preact/hooks";
import { dayNs, timecode } from "../model/timecode";
import { connection, status, statusAt } from "../state/store";

export function Timecode() {
  const place = useRef<HTMLElement>(null);
  const rate = status.value?.timecodeRate ?? "";
  const online = connection.value.kind === "online";
  useEffect(() => {
    if (!rate || !online) return;
    let frame = 0;
    const show = () => {
      const s = status.peek();
      if (s && place.current) {
        const elapsedNs = Math.round(1e6 * (performance.now() - statusAt.peek()));
        const text = timecode(rate, dayNs(s.timeNs + s.unixOffsetNs + BigInt(elapsedNs), s.timecodeUtcOffsetS));
        if (place.current.textContent !== text) place.current.textContent = text;
      }
      frame = requestAnimationFrame(show);
    };
    show();
    return () => cancelAnimationFrame(frame);
  }, [rate, online]);
  if (!rate) return null;
  const offset = status.value?.timecodeUtcOffsetS ?? 0;
  const zone = offset === 0 ? "UTC" : `UTC${offset > 0 ? "+" : "−"}${(Math.abs(offset) / 3600).toFixed(offset % 3600 === 0 ? 0 : 1)} h`;
  return (
    <div class="figure" title={`Time of day (${zone}) at ${rate} frames a second, as takes and frames have it`}>
      <dt>Timecode {rate}</dt>
      <dd class="timecode tabular" data-testid="timecode">
        <span role="timer" aria-live="off" ref={place} />
      </dd>
    </div>
  );
}
