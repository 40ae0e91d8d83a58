// The floor: a grid of one metre with finer lines of half a metre, and the room's axes. Metres, Z up.

import { BufferGeometry, Float32BufferAttribute, Group, LineBasicMaterial, LineSegments, Vector3 } from "three";
import type { Palette } from "./palette";

const HALF = 6;
const AXIS = 1;

export interface AxisTip {
  name: string;
  at: Vector3;
}

/** Where the names of the axes go. */
export const AXIS_TIPS: AxisTip[] = [
  { name: "x", at: new Vector3(AXIS + 0.1, 0, 0) },
  { name: "y", at: new Vector3(0, AXIS + 0.1, 0) },
  { name: "z", at: new Vector3(0, 0, AXIS * 0.5 + 0.1) },
];

export class Floor {
  readonly group = new Group();
  private fine = lines(gridPoints(0.5, (i) => i % 2 !== 0), true);
  private strong = lines(gridPoints(1, () => true), true);
  private axes = [
    lines([0, 0, 0.004, AXIS, 0, 0.004], false),
    lines([0, 0, 0.004, 0, AXIS, 0.004], false),
    lines([0, 0, 0.004, 0, 0, AXIS * 0.5], false),
  ];

  constructor() {
    this.group.add(this.fine, this.strong, ...this.axes);
  }

  paint(palette: Palette): void {
    this.fine.material.color = palette.grid;
    this.fine.material.opacity = 0.55;
    this.strong.material.color = palette.gridStrong;
    this.axes.forEach((axis, i) => (axis.material.color = palette.axes[i]!));
  }
}

function gridPoints(step: number, keep: (i: number) => boolean): number[] {
  const points: number[] = [];
  const n = Math.round(HALF / step);
  for (let i = -n; i <= n; i++) {
    if (!keep(i)) continue;
    const at = i * step;
    points.push(-HALF, at, 0, HALF, at, 0, at, -HALF, 0, at, HALF, 0);
  }
  return points;
}

function lines(points: number[], transparent: boolean): LineSegments<BufferGeometry, LineBasicMaterial> {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(points, 3));
  return new LineSegments(geometry, new LineBasicMaterial({ transparent }));
}
