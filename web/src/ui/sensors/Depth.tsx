// A sensor's depth preview: the picture with the tracked skeletons on it, what its colours mean, and how to aim by it.
// Where there is none, why.

import { useEffect, useRef, useState } from "preact/hooks";
import { SensorState, type SensorStatus } from "../../gen/posefuse/v1/room_pb";
import { bonesOf, depthColour, depthFacts, paintDepth, rangeOf, type DepthImage, type DepthRange } from "../../model/depth";
import { fixed, plural } from "../../model/format";
import { depthLarge, depthOf, showDepth } from "../../state/depth";
import { connection, dialog, sensors } from "../../state/store";
import { Modal } from "../Modal";

export function DepthPanel({ sensor, large = false }: { sensor: SensorStatus; large?: boolean }) {
  const name = sensor.info?.name ?? "";
  const host = useRef<HTMLDivElement>(null);
  useWhileSeen(host, name, sensor.depthPreview);
  return (
    <div class={`depth ${large ? "large" : ""}`} ref={host} data-testid="depth" data-sensor={name}>
      {sensor.depthPreview ? <Picture sensor={sensor} large={large} /> : <p class="muted">{whyNone(sensor)}</p>}
    </div>
  );
}

/** Why a sensor has no preview, and what would have one. */
function whyNone(sensor: SensorStatus): string {
  const model = sensor.info?.model || "a sensor of no known model";
  if (sensor.state === SensorState.DISCONNECTED) return "No depth images: its agent is gone.";
  return `No depth images: its agent (${model}) passes on the skeletons of a tracker and has no depth to show. Agents that track people in depth images themselves have.`;
}

/** Streams a preview only while it is on the screen. */
function useWhileSeen(host: { current: HTMLElement | null }, sensor: string, wanted: boolean): void {
  useEffect(() => {
    if (!wanted || !host.current) return;
    let stop: (() => void) | null = null;
    const observer = new IntersectionObserver(([entry]) => {
      if (entry?.isIntersecting) stop ??= showDepth(sensor);
      else {
        stop?.();
        stop = null;
      }
    });
    observer.observe(host.current);
    return () => {
      observer.disconnect();
      stop?.();
    };
  }, [sensor, wanted]);
}

function Picture({ sensor, large }: { sensor: SensorStatus; large: boolean }) {
  const name = sensor.info?.name ?? "";
  const range = rangeOf(sensor.nearM, sensor.farM);
  const canvas = useRef<HTMLCanvasElement>(null);
  const [facts, setFacts] = useState<Facts | null>(null);
  useEffect(() => {
    // Still there while this effect is being undone, when the reference is not.
    const element = canvas.current!;
    const screen = new Screen(element);
    let told = -Infinity;
    const show = () => {
      const depth = depthOf(name).value;
      screen.draw(depth?.image ?? null, range);
      element.dataset["bodies"] = String(depth?.image.bodies.length ?? 0);
      const now = performance.now();
      // Figures that change ten times a second cannot be read.
      if (depth && now - told < 500) return;
      told = now;
      setFacts(depth ? { ...depthFacts(depth.image), rate: depth.rate, bodies: depth.image.bodies.length } : null);
    };
    show();
    const stop = depthOf(name).on(show);
    const resized = new ResizeObserver(show);
    resized.observe(element);
    return () => {
      stop();
      resized.disconnect();
    };
  }, [name, range.near, range.far]);
  const waiting = sensor.state === SensorState.DISCONNECTED || connection.value.kind !== "online" ? "Its agent is gone." : "Waiting for the first image …";
  return (
    <>
      <div class="depth-screen">
        <canvas ref={canvas} role="img" aria-label={words(name, facts)} data-testid="depth-canvas" data-live={facts !== null} data-rate={facts?.rate.toFixed(1) ?? ""} />
        {!facts && <span class="depth-wait">{waiting}</span>}
        {!large && (
          <button type="button" class="small depth-enlarge" aria-label={`Enlarge the depth of ${name}`} title="Enlarge" data-testid="depth-enlarge" onClick={() => enlarge(name)}>
            <span aria-hidden="true">⤢</span>
          </button>
        )}
      </div>
      <Scale range={range} />
      <p class="depth-facts tabular" data-testid="depth-facts">
        <span>{facts ? fixed(facts.rate, 0, "fps") : "–"}</span>
        <span>{facts ? plural(facts.bodies, "person", "people") : "–"}</span>
        <span title="Share of the picture in which the sensor measures nothing">{facts ? fixed(100 * facts.holes, 0, "% without depth") : "–"}</span>
      </p>
    </>
  );
}

interface Facts {
  holes: number;
  nearM: number | null;
  rate: number;
  bodies: number;
}

function words(name: string, facts: Facts | null): string {
  if (!facts) return `Depth of ${name}, no image yet`;
  const near = facts.nearM === null ? "nothing is measured" : `the nearest things are ${fixed(facts.nearM, 1, "m")} away`;
  return `Depth of ${name}: ${plural(facts.bodies, "person", "people")} tracked, ${near}, ${fixed(100 * facts.holes, 0, "%")} without depth`;
}

function Scale({ range }: { range: DepthRange }) {
  const stops = Array.from({ length: 7 }, (_, i) => `rgb(${depthColour(i / 6).join(" ")}) ${Math.round((100 * i) / 6)}%`);
  return (
    <div class="depth-scale">
      <span class="tabular">{fixed(range.near, 1, "m")}</span>
      <span class="depth-ramp" style={{ background: `linear-gradient(to right, ${stops.join(", ")})` }} role="img" aria-label="Light is near, dark is far" />
      <span class="tabular">{fixed(range.far, 1, "m")}</span>
      <span class="depth-hole" aria-hidden="true" />
      <span>none</span>
    </div>
  );
}

function enlarge(name: string): void {
  depthLarge.value = name;
  dialog.value = "depth";
}

export function DepthDialog() {
  const name = depthLarge.value;
  const sensor = sensors.value.find((s) => s.info?.name === name);
  return (
    <Modal name="depth" title={name ? `Depth of ${name}` : "Depth"} wide>
      {sensor ? <DepthPanel sensor={sensor} large /> : <p class="muted">This sensor is not in the room any more.</p>}
      <p class="muted">
        The picture is what the sensor sees, not mirrored: its left is on the left. A person should stand in it from head to foot, between {fixed(sensor?.nearM || 0.5, 1, "m")} and{" "}
        {fixed(sensor?.farM || 4.5, 1, "m")}, with as few stripes on them as possible; dashed bones are guesses.
      </p>
    </Modal>
  );
}

/** Draws images and skeletons into one canvas, at the resolution of the screen. */
class Screen {
  private small = document.createElement("canvas");
  private pixels: ImageData | null = null;

  constructor(private canvas: HTMLCanvasElement) {}

  draw(image: DepthImage | null, range: DepthRange): void {
    const context = this.canvas.getContext("2d");
    const pen = this.small.getContext("2d");
    if (!context || !pen) return;
    const [width, height] = [image?.width ?? 4, image?.height ?? 3];
    this.canvas.style.aspectRatio = `${width} / ${height}`;
    const across = Math.max(Math.round(this.canvas.clientWidth * devicePixelRatio), 1);
    const down = Math.max(Math.round((across * height) / width), 1);
    if (this.canvas.width !== across || this.canvas.height !== down) Object.assign(this.canvas, { width: across, height: down });
    context.clearRect(0, 0, across, down);
    if (!image) return;
    if (this.pixels?.width !== width || this.pixels.height !== height) {
      Object.assign(this.small, { width, height });
      this.pixels = pen.createImageData(width, height);
    }
    paintDepth(image, range, this.pixels.data);
    pen.putImageData(this.pixels, 0, 0);
    context.imageSmoothingEnabled = false;
    context.drawImage(this.small, 0, 0, across, down);
    this.skeletons(context, image, across / width);
  }

  private skeletons(context: CanvasRenderingContext2D, image: DepthImage, scale: number): void {
    const at = ([u, v]: [number, number]): [number, number] => [(u + 0.5) * scale, (v + 0.5) * scale];
    const wide = Math.max(this.canvas.width / 160, devicePixelRatio);
    context.lineCap = "round";
    // White with a black edge, in both themes: the picture below is light and dark in both.
    for (const [style, width] of [["#000", 3.2 * wide], ["#fff", 1.7 * wide]] as const) {
      context.strokeStyle = style;
      context.lineWidth = width;
      for (const body of image.bodies) {
        for (const { from, to, sure } of bonesOf(body)) {
          context.setLineDash(sure ? [] : [2.5 * wide, 3.5 * wide]);
          context.beginPath();
          context.moveTo(...at(from));
          context.lineTo(...at(to));
          context.stroke();
        }
      }
    }
    context.setLineDash([]);
  }
}
