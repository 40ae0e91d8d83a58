// Depth previews: from bytes to a picture that everybody can read, and the tracked skeletons' place in it.
//
// Near is light yellow, far is dark blue: lightness falls all the way, so that it also reads without colour. Where the
// sensor has no depth there are stripes, which no distance looks like.

import type { DepthPreview } from "../gen/posefuse/v1/types_pb";
import { BONES, JOINT_COUNT } from "./joints";

export interface DepthImage {
  width: number;
  height: number;
  /** Millimetres along the optical axis, row after row; 0: none. */
  millimetres: Uint16Array;
  camera: { fx: number; fy: number; cx: number; cy: number };
  bodies: DepthBody[];
}

export interface DepthBody {
  /** 25 joints in canonical order, pixels of the image; null: missing, or not in front of the camera. */
  joints: ({ u: number; v: number; sure: boolean } | null)[];
}

/** A joint below this confidence is drawn as a guess. */
const SURE = 0.5;

/** Null when the message is not what it says it is. */
export function decodeDepth(preview: DepthPreview): DepthImage | null {
  const { width, height, millimetres: bytes, camera } = preview;
  if (!camera || width < 1 || height < 1 || bytes.length !== 2 * width * height) return null;
  if (!(camera.fx > 0) || !(camera.fy > 0)) return null;
  const millimetres = new Uint16Array(width * height);
  for (let i = 0; i < millimetres.length; i++) millimetres[i] = bytes[2 * i]! | (bytes[2 * i + 1]! << 8);
  const { fx, fy, cx, cy } = camera;
  const bodies: DepthBody[] = [];
  for (const { positions, confidences } of preview.bodies) {
    if (positions.length !== 3 * JOINT_COUNT || confidences.length !== JOINT_COUNT) continue;
    const joints: DepthBody["joints"] = [];
    for (let i = 0; i < JOINT_COUNT; i++) {
      const z = positions[3 * i + 2]!;
      const seen = confidences[i]! > 0 && z > 0.05;
      joints.push(seen ? { u: (positions[3 * i]! / z) * fx + cx, v: (positions[3 * i + 1]! / z) * fy + cy, sure: confidences[i]! >= SURE } : null);
    }
    bodies.push({ joints });
  }
  return { width, height, millimetres, camera: { fx, fy, cx, cy }, bodies };
}

/** What the colours stand for, metres. */
export interface DepthRange {
  near: number;
  far: number;
}

/** What a sensor measures, or what most do. */
export function rangeOf(nearM: number, farM: number): DepthRange {
  return farM > nearM && nearM >= 0 ? { near: nearM, far: farM } : { near: 0.5, far: 4.5 };
}

const RAMP: readonly (readonly [number, number, number])[] = [
  [255, 241, 170],
  [233, 196, 84],
  [176, 150, 108],
  [112, 112, 126],
  [58, 80, 132],
  [14, 34, 92],
];
const STEPS = 256;
const TABLE = Uint8Array.from({ length: 3 * STEPS }, (_, i) => {
  const at = (Math.floor(i / 3) / (STEPS - 1)) * (RAMP.length - 1);
  const below = Math.min(Math.floor(at), RAMP.length - 2);
  const [a, b] = [RAMP[below]![i % 3]!, RAMP[below + 1]![i % 3]!];
  return Math.round(a + (at - below) * (b - a));
});

/** Red, green and blue of a share of the range: 0 near, 1 far. */
export function depthColour(share: number): [number, number, number] {
  const at = 3 * Math.round(Math.min(Math.max(share, 0), 1) * (STEPS - 1));
  return [TABLE[at]!, TABLE[at + 1]!, TABLE[at + 2]!];
}

/** Two shades of the stripes where there is no depth. */
const HOLES = [
  [46, 20, 44],
  [88, 44, 82],
] as const;

/** Paints an image into RGBA bytes, 4 a pixel. */
export function paintDepth(image: DepthImage, range: DepthRange, rgba: Uint8ClampedArray): void {
  const near = 1000 * range.near;
  const scale = (STEPS - 1) / (1000 * (range.far - range.near));
  for (let i = 0, at = 0; i < image.millimetres.length; i++, at += 4) {
    const depth = image.millimetres[i]!;
    rgba[at + 3] = 255;
    if (depth === 0) {
      const stripe = HOLES[((i % image.width) + Math.floor(i / image.width)) & 4 ? 1 : 0]!;
      rgba[at] = stripe[0];
      rgba[at + 1] = stripe[1];
      rgba[at + 2] = stripe[2];
      continue;
    }
    const step = 3 * Math.min(Math.max(Math.round((depth - near) * scale), 0), STEPS - 1);
    rgba[at] = TABLE[step]!;
    rgba[at + 1] = TABLE[step + 1]!;
    rgba[at + 2] = TABLE[step + 2]!;
  }
}

/** The bones of a body as lines in the image, pixels. */
export function bonesOf(body: DepthBody): { from: [number, number]; to: [number, number]; sure: boolean }[] {
  return BONES.flatMap(([a, b]) => {
    const [from, to] = [body.joints[a], body.joints[b]];
    return from && to ? [{ from: [from.u, from.v] as [number, number], to: [to.u, to.v] as [number, number], sure: from.sure && to.sure }] : [];
  });
}

/** Share of the pixels without depth, and how near the nearest twentieth of the others is: what an aim is judged by. */
export function depthFacts(image: DepthImage): { holes: number; nearM: number | null } {
  const bins = new Uint32Array(656);
  let holes = 0;
  for (const depth of image.millimetres) {
    if (depth === 0) holes += 1;
    else bins[Math.floor(depth / 100)]! += 1;
  }
  const seen = image.millimetres.length - holes;
  let below = 0;
  for (let bin = 0; bin < bins.length; bin++) {
    below += bins[bin]!;
    if (seen > 0 && below >= seen / 20) return { holes: holes / image.millimetres.length, nearM: (bin + 0.5) / 10 };
  }
  return { holes: holes / Math.max(image.millimetres.length, 1), nearM: null };
}

/** Counts what came within the last seconds. */
export class Rate {
  private times: number[] = [];

  constructor(private windowMs = 2000) {}

  add(nowMs: number): void {
    this.times.push(nowMs);
    this.forget(nowMs);
  }

  perSecond(nowMs: number): number {
    this.forget(nowMs);
    if (this.times.length < 2) return this.times.length === 0 ? 0 : 1000 / this.windowMs;
    return (1000 * (this.times.length - 1)) / (this.times[this.times.length - 1]! - this.times[0]!);
  }

  private forget(nowMs: number): void {
    while (this.times.length > 0 && nowMs - this.times[0]! > this.windowMs) this.times.shift();
  }
}
