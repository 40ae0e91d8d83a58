// The calibration wizard: what to do, how it goes, whether to trust what came out. Not modal: beside the room it is a
// panel; while somebody walks it fills the window, unless it is made small.

import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { closeCalibrate, large, repeatCalibrate } from "../../state/calibrate";
import { calibrating } from "../../state/store";
import { Intro } from "./Intro";
import { Result } from "./Result";
import { Walking } from "./Walking";

export function CalibratePanel() {
  const c = calibrating.value;
  const title = useRef<HTMLHeadingElement>(null);
  // A result puts the focus on what it advises. At once, so that the next key is the wizard's.
  useLayoutEffect(() => {
    if (c.kind !== "done") title.current?.focus();
  }, [c.kind]);
  const running = c.kind === "running";
  const section = useRef<HTMLElement>(null);
  // In a narrow window the panel lies below the room.
  useEffect(() => section.current?.scrollIntoView({ block: "nearest" }), [large.value]);
  const fills = large.value && (running || c.kind === "done" || c.kind === "failed");
  const escape = (event: KeyboardEvent) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    // A walk of half a minute is not thrown away by one key: Escape only makes it small.
    if (running) large.value = false;
    else closeCalibrate();
  };
  return (
    <section
      ref={section}
      class={fills ? "panel calibrate fills" : "panel calibrate"}
      role="dialog"
      aria-labelledby="calibrate-title"
      data-testid="calibrate-panel"
      data-state={c.kind}
      onKeyDown={escape}
    >
      <header class="panel-head">
        <h2 id="calibrate-title" ref={title} tabIndex={-1}>
          Calibrate
        </h2>
        <div class="row">
          {c.kind !== "intro" && (
            <button type="button" data-testid="calibrate-large" aria-pressed={large.value} onClick={() => (large.value = !large.value)}>
              {large.value ? "Make it small" : "Fill the window"}
            </button>
          )}
          {running ? (
            <button type="button" data-testid="calibrate-cancel" onClick={c.cancel}>
              Cancel
            </button>
          ) : (
            <button type="button" data-testid="calibrate-close" onClick={closeCalibrate}>
              Close
            </button>
          )}
        </div>
      </header>
      {c.kind === "intro" && <Intro />}
      {c.kind === "running" && <Walking progress={c.progress} />}
      {c.kind === "done" && <Result result={c.result} decision={c.decision} />}
      {c.kind === "failed" && (
        <div class="panel-body">
          <p class="card-trouble bad" role="alert" data-testid="calibrate-trouble">
            {c.trouble}
          </p>
          <div class="row">
            <button type="button" class="primary" onClick={repeatCalibrate}>
              Try again
            </button>
          </div>
        </div>
      )}
    </section>
  );
}
