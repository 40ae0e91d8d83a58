// Raw skeletons as thin lines, one colour per sensor.

import { BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Group, LineBasicMaterial, LineSegments, Points, PointsMaterial } from "three";
import { BONES, JOINT_COUNT } from "../model/joints";
import type { RawBody } from "../model/raw";
import type { Palette } from "./palette";

const MAX_BODIES = 64;

export class RawView {
  readonly group = new Group();
  private lines: LineSegments<BufferGeometry, LineBasicMaterial>;
  private points: Points<BufferGeometry, PointsMaterial>;
  private colours: Color[] = [];

  constructor() {
    this.lines = new LineSegments(buffer(MAX_BODIES * BONES.length * 2), new LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.9 }));
    this.points = new Points(buffer(MAX_BODIES * JOINT_COUNT), new PointsMaterial({ vertexColors: true, size: 0.03 }));
    for (const object of [this.lines, this.points]) object.frustumCulled = false;
    this.group.add(this.lines, this.points);
  }

  paint(palette: Palette): void {
    this.colours = palette.sensors;
  }

  /** Returns how many bodies were drawn. */
  update(bodies: readonly RawBody[]): number {
    let lineAt = 0;
    let pointAt = 0;
    const drawn = bodies.slice(0, MAX_BODIES);
    for (const { colour: index, positions } of drawn) {
      const colour = this.colours[index]!;
      for (const [a, b] of BONES) {
        if (Number.isNaN(positions[3 * a]!) || Number.isNaN(positions[3 * b]!)) continue;
        put(this.lines.geometry, lineAt++, positions, a, colour);
        put(this.lines.geometry, lineAt++, positions, b, colour);
      }
      for (let i = 0; i < JOINT_COUNT; i++) {
        if (!Number.isNaN(positions[3 * i]!)) put(this.points.geometry, pointAt++, positions, i, colour);
      }
    }
    finish(this.lines.geometry, lineAt);
    finish(this.points.geometry, pointAt);
    return drawn.length;
  }
}

function buffer(vertices: number): BufferGeometry {
  const geometry = new BufferGeometry();
  for (const name of ["position", "color"]) {
    geometry.setAttribute(name, new BufferAttribute(new Float32Array(3 * vertices), 3).setUsage(DynamicDrawUsage));
  }
  geometry.setDrawRange(0, 0);
  return geometry;
}

function put(geometry: BufferGeometry, at: number, positions: Float32Array, joint: number, colour: Color): void {
  geometry.attributes["position"]!.setXYZ(at, positions[3 * joint]!, positions[3 * joint + 1]!, positions[3 * joint + 2]!);
  geometry.attributes["color"]!.setXYZ(at, colour.r, colour.g, colour.b);
}

function finish(geometry: BufferGeometry, count: number): void {
  geometry.setDrawRange(0, count);
  geometry.attributes["position"]!.needsUpdate = true;
  geometry.attributes["color"]!.needsUpdate = true;
}
