// Calibration: what to do, how it goes, and whether to trust what came out. Not modal: the operator watches the walk.

import { useEffect, useRef, useState } from "preact/hooks";
import { Verdict, type CalibrateProgress, type CalibrateResult } from "../gen/posefuse/v1/room_pb";
import { count, duration, fixed } from "../model/format";
import { coverage, linkOf, type Grade } from "../model/progress";
import { calibrate } from "../state/calibrate";
import { calibrating, liveSensors, sensors } from "../state/store";

export function CalibratePanel() {
  const c = calibrating.value;
  const title = useRef<HTMLHeadingElement>(null);
  useEffect(() => title.current?.focus(), []);
  const close = () => (calibrating.value = { kind: "closed" });
  const running = c.kind === "running";
  return (
    <section
      class="panel calibrate"
      role="dialog"
      aria-labelledby="calibrate-title"
      data-testid="calibrate-panel"
      data-state={c.kind}
      onKeyDown={(event) => {
        if (event.key !== "Escape" || running) return;
        event.stopPropagation();
        close();
      }}
    >
      <header class="panel-head">
        <h2 id="calibrate-title" ref={title} tabIndex={-1}>
          Calibrate
        </h2>
        {!running && (
          <button type="button" data-testid="calibrate-close" onClick={close}>
            Close
          </button>
        )}
      </header>
      <div class="panel-body">
        {c.kind === "intro" && <Intro />}
        {c.kind === "running" && <Running progress={c.progress} cancel={c.cancel} />}
        {c.kind === "done" && <Result result={c.result} />}
        {c.kind === "failed" && (
          <>
            <p class="card-trouble bad" role="alert" data-testid="calibrate-trouble">
              {c.trouble}
            </p>
            <button type="button" onClick={() => (calibrating.value = { kind: "intro" })}>
              Try again
            </button>
          </>
        )}
      </div>
    </section>
  );
}

function Intro() {
  const [seconds, setSeconds] = useState(30);
  const [dryRun, setDryRun] = useState(false);
  const few = liveSensors.value < 2;
  return (
    <>
      <p>Exactly one person is in the room. While it runs:</p>
      <ol class="steps">
        <li>
          <strong>Walk about</strong> the whole floor, not only its middle.
        </li>
        <li>
          <strong>Turn around</strong> now and then, so that each sensor sees your front.
        </li>
        <li>
          <strong>Reach</strong> up and to the sides; crouch once.
        </li>
      </ol>
      <p class="muted">Everybody else waits outside. Nobody touches a sensor.</p>
      <form
        class="calibrate-form"
        onSubmit={(event) => {
          event.preventDefault();
          void calibrate(seconds, dryRun);
        }}
      >
        <label>
          For
          <input type="number" min={5} max={300} step={1} value={seconds} data-testid="calibrate-seconds" onInput={(e) => setSeconds(Number(e.currentTarget.value))} /> seconds
        </label>
        <label class="check">
          <input type="checkbox" checked={dryRun} onChange={(e) => setDryRun(e.currentTarget.checked)} />
          Only report, change nothing
        </label>
        {few && <p class="warn-text">▲ {liveSensors.value} of {sensors.value.length} sensors live: it takes two to calibrate.</p>}
        <button type="submit" class="primary" data-testid="calibrate-start">
          Start
        </button>
      </form>
    </>
  );
}

const GRADES: Record<Grade, string> = { few: "few", fair: "fair", good: "good" };

function Running({ progress, cancel }: { progress: CalibrateProgress | null; cancel(): void }) {
  const total = progress?.totalSeconds ?? 0;
  const done = progress && total > 0 ? Math.min(progress.elapsedSeconds / total, 1) : 0;
  const left = total - (progress?.elapsedSeconds ?? 0);
  const word = !progress ? "Waiting for the first frames …" : left > 0 ? `${duration(left)} left. Walk, turn around, reach.` : "Solving …";
  return (
    <>
      <p class="calibrate-left" role="status">
        {word}
      </p>
      <progress max={1} value={done} aria-label="Time gathered" data-testid="calibrate-progress" />
      <table class="figures-table">
        <thead>
          <tr>
            <th scope="col">Sensor</th>
            <th scope="col" class="num" title="Frames in which it saw somebody">Frames</th>
            <th scope="col" title="Floor cells of 0.5 m in which it saw somebody">Floor</th>
            <th scope="col" title="Time of view shared with one other sensor">Shared</th>
          </tr>
        </thead>
        <tbody>
          {(progress?.sensors ?? []).map((s) => {
            const floor = coverage(s.cells);
            const rate = sensors.value.find((known) => known.info?.name === s.sensor)?.framesPerSecond ?? 0;
            const link = linkOf(s, rate);
            return (
              <tr key={s.sensor}>
                <th scope="row">{s.sensor}</th>
                <td class="num">{count(s.frames)}</td>
                <td class={`grade ${floor}`}>
                  {s.cells} <span>{GRADES[floor]}</span>
                </td>
                <td class={`grade ${link.grade}`} title={link.partner ? `with ${link.partner}` : ""}>
                  {fixed(link.seconds, 0, "s")} <span>{GRADES[link.grade]}</span>
                </td>
              </tr>
            );
          })}
        </tbody>
      </table>
      <p class="muted">The words are a guide while walking. The verdict comes at the end, from frames held back.</p>
      <button type="button" data-testid="calibrate-cancel" onClick={cancel}>
        Cancel
      </button>
    </>
  );
}

const VERDICTS: Record<Verdict, { word: string; kind: string; icon: string }> = {
  [Verdict.PASSED]: { word: "Passed", kind: "ok", icon: "✓" },
  [Verdict.WEAK]: { word: "Weak", kind: "warn", icon: "▲" },
  [Verdict.FAILED]: { word: "Failed", kind: "bad", icon: "✕" },
  [Verdict.UNSPECIFIED]: { word: "No verdict", kind: "muted", icon: "?" },
};

function Result({ result }: { result: CalibrateResult }) {
  const verdict = VERDICTS[result.verdict] ?? VERDICTS[Verdict.UNSPECIFIED];
  const mm = (m: number) => fixed(m * 1000, 0);
  return (
    <div data-testid="calibrate-result" data-verdict={verdict.word.toLowerCase()}>
      <p class={`verdict ${verdict.kind}`} role="status">
        <span aria-hidden="true">{verdict.icon}</span> {verdict.word}
        <span class="verdict-force">{result.inForce ? "in force now" : "not in force"}</span>
      </p>
      {result.reasons.length > 0 && (
        <ul class="reasons">
          {result.reasons.map((reason) => (
            <li key={reason}>{reason}</li>
          ))}
        </ul>
      )}
      {result.pairs.length > 0 && (
        <table class="figures-table">
          <caption>How far two sensors' joints lie apart on frames held back, mm</caption>
          <thead>
            <tr>
              <th scope="col">Pair</th>
              <th scope="col" class="num">Before (RMS)</th>
              <th scope="col" class="num">After (median)</th>
              <th scope="col" class="num">95 %</th>
              <th scope="col" class="num">Samples</th>
            </tr>
          </thead>
          <tbody>
            {result.pairs.map((p) => (
              <tr key={`${p.a} ${p.b}`}>
                <th scope="row">
                  {p.a} – {p.b}
                </th>
                <td class="num">{mm(p.beforeRmsM)}</td>
                <td class="num strong">{mm(p.afterMedianM)}</td>
                <td class="num">{mm(p.afterP95M)}</td>
                <td class="num">{count(p.samples)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
      <button type="button" onClick={() => (calibrating.value = { kind: "intro" })}>
        Calibrate again
      </button>
    </div>
  );
}
