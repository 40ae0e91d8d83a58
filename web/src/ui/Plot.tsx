// One small plot over the last seconds: a canvas, and a legend whose entries switch lines on and off. The legend
// shows the latest values, or those under the pointer.

import { useEffect, useRef, useState } from "preact/hooks";
import { fixed } from "../model/format";
import { axisTop, type Series } from "../model/series";
import { cssColour } from "../scene/palette";

export interface Line {
  label: string;
  /** The style sheet's name of its colour, e.g. `--plot-0`. */
  colour: string;
  /** CSS class of its legend mark. */
  mark: string;
  /** Left out until switched on. */
  off?: boolean;
  /** Nothing comes any more: the latest value is no value of now. */
  ended?: boolean;
  series: Series | undefined;
}

interface Props {
  title: string;
  /** Other things the plot can show in its place; `title` is one of their labels. */
  choices?: { key: string; label: string }[];
  onChoose?(key: string): void;
  unit: string;
  digits: number;
  /** Smallest top of the value axis, so that noise does not fill the plot. */
  floor: number;
  span: number;
  empty: string;
  testid: string;
  lines(): Line[];
}

const REDRAW_MS = 100;
const LEFT = 34;
const BOTTOM = 16;
const TOP = 8;
/** A pause longer than this is drawn as a gap, seconds. */
const GAP = 1.2;

/** The figures of a plot over minutes come less often. */
function gapOf(span: number): number {
  return Math.max(GAP, span / 60);
}

export function Plot(props: Props) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const hover = useRef<number | null>(null);
  const [off, setOff] = useState<ReadonlySet<string>>(() => new Set(props.lines().filter((l) => l.off).map((l) => l.label)));
  const [, tick] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => {
      if (document.hidden || !canvas.current) return;
      const lines = props.lines().filter((l) => !off.has(l.label));
      draw(canvas.current, lines, props, hover.current);
      tick((n) => n + 1);
    }, REDRAW_MS);
    return () => clearInterval(timer);
  });
  const lines = props.lines();
  const any = lines.some((l) => (l.series?.points.length ?? 0) > 1);
  const latest = newest(lines);
  const at = hover.current === null ? null : latest - props.span * (1 - hover.current);
  return (
    <section class="plot" aria-label={props.title} data-testid={props.testid} data-lines={lines.filter((l) => l.series?.points.length).length}>
      <header class="plot-head">
        <h2>
          {props.choices ? <Choice {...props} choices={props.choices} /> : props.title} <span class="muted">{props.unit}</span>
        </h2>
        <div class="plot-legend" role="group" aria-label="Lines">
          {lines.map((line) => {
            const latestOf = line.ended ? undefined : line.series?.latest;
            const point = at === null ? latestOf : line.series?.near(at, 0.5);
            return (
              <button key={line.label} type="button" class="plot-key" aria-pressed={!off.has(line.label)} onClick={() => setOff(toggled(off, line.label))}>
                <span class={`dash ${line.mark}`} aria-hidden="true" />
                {line.label}
                {!off.has(line.label) && <span class="tabular value">{fixed(point?.value, props.digits)}</span>}
              </button>
            );
          })}
        </div>
      </header>
      <div class="plot-body">
        <canvas
          ref={canvas}
          aria-hidden="true"
          onPointerMove={(event) => {
            const box = event.currentTarget.getBoundingClientRect();
            const share = (event.clientX - box.left - LEFT) / (box.width - LEFT);
            hover.current = share >= 0 && share <= 1 ? share : null;
          }}
          onPointerLeave={() => (hover.current = null)}
        />
        {!any && (
          <p class="plot-empty">
            <span>{props.empty}</span>
          </p>
        )}
      </div>
    </section>
  );
}

function Choice({ title, choices, onChoose, testid }: Props & { choices: { key: string; label: string }[] }) {
  return (
    <select class="plot-choice" aria-label="What the plot shows" data-testid={`${testid}-choice`} onChange={(event) => onChoose?.(event.currentTarget.value)}>
      {choices.map(({ key, label }) => (
        <option key={key} value={key} selected={label === title}>
          {label}
        </option>
      ))}
    </select>
  );
}

function toggled(set: ReadonlySet<string>, item: string): ReadonlySet<string> {
  const next = new Set(set);
  if (!next.delete(item)) next.add(item);
  return next;
}

function newest(lines: Line[]): number {
  return lines.reduce((time, l) => Math.max(time, l.series?.latest?.time ?? -Infinity), -Infinity);
}

function draw(canvas: HTMLCanvasElement, lines: Line[], props: Props, hover: number | null): void {
  const ratio = Math.min(devicePixelRatio, 2);
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  if (width < 20 || height < 20) return;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const g = canvas.getContext("2d")!;
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, width, height);
  const latest = newest(lines);
  const largest = lines.reduce((top, l) => Math.max(top, ...(l.series?.points ?? []).map((p) => p.value)), 0);
  const scale = {
    x: (time: number) => LEFT + (1 - (latest - time) / props.span) * (width - LEFT),
    y: (value: number) => height - BOTTOM - (value / top) * (height - BOTTOM - TOP),
  };
  const top = axisTop(largest, props.floor);
  drawAxes(g, width, height, top, props.span, scale.y);
  g.lineWidth = 1.5;
  g.lineJoin = "round";
  for (const line of lines) drawLine(g, line, scale, latest - props.span, gapOf(props.span));
  if (hover !== null && Number.isFinite(latest)) {
    const x = LEFT + hover * (width - LEFT);
    g.strokeStyle = cssColour("--muted");
    g.lineWidth = 1;
    g.beginPath();
    g.moveTo(x, TOP);
    g.lineTo(x, height - BOTTOM);
    g.stroke();
  }
}

function drawAxes(g: CanvasRenderingContext2D, width: number, height: number, top: number, span: number, y: (v: number) => number): void {
  g.font = "10.5px system-ui, sans-serif";
  g.fillStyle = cssColour("--muted");
  g.strokeStyle = cssColour("--line");
  g.lineWidth = 1;
  g.textBaseline = "middle";
  g.textAlign = "right";
  for (const share of [0, 0.5, 1]) {
    const at = Math.round(y(share * top)) + 0.5;
    g.beginPath();
    g.moveTo(LEFT, at);
    g.lineTo(width, at);
    g.stroke();
    g.fillText(String(Number((share * top).toPrecision(3))), LEFT - 5, at);
  }
  g.textBaseline = "alphabetic";
  // Minutes leave one out, or their labels would touch.
  const step = span > 60 ? 120 : 10;
  for (const back of [...Array.from({ length: Math.ceil(span / step) }, (_, i) => span - i * step), 0]) {
    const x = LEFT + (1 - back / span) * (width - LEFT);
    g.textAlign = back === span ? "left" : back === 0 ? "right" : "center";
    g.fillText(back === 0 ? "now" : span > 60 ? `−${back / 60} min` : `−${back} s`, x, height - 3);
  }
}

function drawLine(g: CanvasRenderingContext2D, line: Line, scale: { x(t: number): number; y(v: number): number }, from: number, gap: number): void {
  const points = line.series?.points ?? [];
  g.strokeStyle = cssColour(line.colour);
  g.beginPath();
  let before = -Infinity;
  for (const { time, value } of points) {
    if (time < from) continue;
    const x = scale.x(time);
    if (time - before > gap) g.moveTo(x, scale.y(value));
    else g.lineTo(x, scale.y(value));
    before = time;
  }
  g.stroke();
}
