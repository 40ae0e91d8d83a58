import { PerspectiveCamera, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { frameAll } from "./fit";

describe("a camera that is to see everything", () => {
  const points = [new Vector3(3, 2, 0), new Vector3(-3, 1, 1.9), new Vector3(0.5, -4, 1.2), new Vector3(0, 0, 0)];

  it.each([
    [new Vector3(1, 0, 0.12), 1.6],
    [new Vector3(-0.001, 0, 1), 1],
    [new Vector3(0.75, -0.9, 0.62), 0.6],
  ])("has all points inside the picture and fills most of one side: %o, aspect %f", (direction, aspect) => {
    const camera = new PerspectiveCamera(40, aspect, 0.05, 100);
    camera.up.set(0, 0, 1);
    const { to, target } = frameAll(points, direction, camera, { across: 0.08, along: 0.15 });
    camera.position.copy(to);
    camera.lookAt(target);
    camera.updateMatrixWorld();
    const seen = points.map((p) => p.clone().project(camera));
    for (const p of seen) {
      expect(Math.abs(p.x)).toBeLessThan(0.98);
      expect(Math.abs(p.y)).toBeLessThan(0.98);
    }
    const width = Math.max(...seen.map((p) => p.x)) - Math.min(...seen.map((p) => p.x));
    const height = Math.max(...seen.map((p) => p.y)) - Math.min(...seen.map((p) => p.y));
    expect(Math.max(width, height)).toBeGreaterThan(1.2);
  });
});
