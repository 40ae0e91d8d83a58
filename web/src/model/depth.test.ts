import { create } from "@bufbuild/protobuf";
import { describe, expect, it } from "vitest";
import { DepthPreviewSchema } from "../gen/posefuse/v1/types_pb";
import { bonesOf, decodeDepth, depthColour, depthFacts, paintDepth, Rate, rangeOf } from "./depth";

const SEEN = new Array(25).fill(1);
const bytes = (...millimetres: number[]) => Uint8Array.from(millimetres.flatMap((mm) => [mm & 255, mm >> 8]));
const preview = (over: object = {}) =>
  create(DepthPreviewSchema, { width: 2, height: 2, millimetres: bytes(0, 500, 4500, 2500), camera: { fx: 100, fy: 100, cx: 0.5, cy: 0.5 }, ...over });

const lightness = ([r, g, b]: number[]) => 0.2126 * r! + 0.7152 * g! + 0.0722 * b!;

describe("depth previews", () => {
  it("are decoded little-endian, and refused when they are not what they say", () => {
    expect([...decodeDepth(preview())!.millimetres]).toEqual([0, 500, 4500, 2500]);
    expect(decodeDepth(preview({ width: 3 }))).toBeNull();
    expect(decodeDepth(preview({ camera: undefined }))).toBeNull();
    expect(decodeDepth(preview({ camera: { fx: 0, fy: 100, cx: 0, cy: 0 } }))).toBeNull();
  });

  it("get darker with the distance all the way, so that colour is not needed to read them", () => {
    let before = Infinity;
    for (let share = 0; share <= 1; share += 0.05) {
      const now = lightness(depthColour(share));
      expect(now).toBeLessThan(before);
      before = now;
    }
    expect(depthColour(-3)).toEqual(depthColour(0));
    expect(depthColour(7)).toEqual(depthColour(1));
  });

  it("paint near, far and beyond, and holes unlike any distance", () => {
    const image = decodeDepth(preview())!;
    const rgba = new Uint8ClampedArray(16);
    paintDepth(image, { near: 0.5, far: 4.5 }, rgba);
    expect([...rgba.slice(4, 7)]).toEqual(depthColour(0));
    expect([...rgba.slice(8, 11)]).toEqual(depthColour(1));
    expect([...rgba.slice(12, 15)]).toEqual(depthColour(0.5));
    const hole = [...rgba.slice(0, 3)];
    for (let share = 0; share <= 1; share += 0.01) {
      const apart = Math.hypot(...depthColour(share).map((c, i) => c - hole[i]!));
      expect(apart).toBeGreaterThan(40);
    }
  });

  it("draw a joint where the camera sees it", () => {
    const positions: number[] = new Array(75).fill(0).map((_, i) => (i % 3 === 2 ? 2 : 0));
    positions[0] = 0.1;
    positions[3 * 3 + 2] = -1;
    const confidences = [...SEEN];
    confidences[1] = 0.2;
    confidences[4] = 0;
    const [body] = decodeDepth(preview({ bodies: [{ positions, confidences }] }))!.bodies;
    expect(body!.joints[0]).toEqual({ u: 5.5, v: 0.5, sure: true });
    expect(body!.joints[1]!.sure).toBe(false);
    expect(body!.joints[3]).toBeNull();
    expect(body!.joints[4]).toBeNull();
    const bones = bonesOf(body!);
    expect(bones).toHaveLength(24 - 3);
    expect(bones[0]).toEqual({ from: [5.5, 0.5], to: [0.5, 0.5], sure: false });
    expect(decodeDepth(preview({ bodies: [{ positions: [1], confidences: SEEN }] }))!.bodies).toEqual([]);
  });

  it("say how much is missing and how near it is", () => {
    expect(depthFacts(decodeDepth(preview())!)).toEqual({ holes: 0.25, nearM: 0.55 });
    expect(depthFacts(decodeDepth(preview({ millimetres: bytes(0, 0, 0, 0) }))!)).toEqual({ holes: 1, nearM: null });
  });

  it("take the usual range where none is known", () => {
    expect(rangeOf(0.3, 3)).toEqual({ near: 0.3, far: 3 });
    expect(rangeOf(0, 0)).toEqual({ near: 0.5, far: 4.5 });
  });

  it("are counted per second", () => {
    const rate = new Rate();
    expect(rate.perSecond(0)).toBe(0);
    for (let t = 0; t <= 3000; t += 100) rate.add(t);
    expect(rate.perSecond(3000)).toBeCloseTo(10);
    expect(rate.perSecond(9000)).toBe(0);
  });
});
