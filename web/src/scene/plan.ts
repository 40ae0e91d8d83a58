// A plan in the 3D view: how many sensors see each place of the floor, where sensors would stand and how far they see,
// and who disturbs whom. Colours are named in styles/theme.css.

import {
  BoxGeometry, BufferGeometry, DataTexture, DoubleSide, EdgesGeometry, Float32BufferAttribute, Group, LineBasicMaterial, LineDashedMaterial, LineSegments, Mesh,
  MeshBasicMaterial, NearestFilter, RGBAFormat, SRGBColorSpace, Vector3, type Color,
} from "three";
import { CLASSES, type PlanMark, type PlanPair, type PlanShown } from "../model/plan";
import type { Label } from "./labels";
import type { Palette } from "./palette";
import { matrixOf } from "./sensors";

const BODY = new EdgesGeometry(new BoxGeometry(0.26, 0.08, 0.08));
/** Over the floor's grid, metres. */
const LIFT_M = 0.006;
const OPACITY = 0.5;
/** How far cones are drawn, metres: to see where sensors look. Only the next one's is drawn as far as it measures. */
const CONE_M = 1.5;

export class PlanView {
  readonly group = new Group();
  private palette: Palette | null = null;
  private plan: PlanShown | null = null;

  paint(palette: Palette): void {
    this.palette = palette;
    this.rebuild();
  }

  update(plan: PlanShown | null): void {
    this.plan = plan;
    this.rebuild();
  }

  /** What a view must hold. */
  points(): Vector3[] {
    if (!this.plan) return [];
    const { area, sensors } = this.plan;
    const corners = [area.minX, area.maxX].flatMap((x) => [area.minY, area.maxY].map((y) => new Vector3(x, y, 0)));
    return [...corners, ...sensors.map(place)];
  }

  /** Names of sensors that are not there yet, and of pairs that disturb each other badly. */
  labels(): Label[] {
    if (!this.plan) return [];
    const { sensors, pairs } = this.plan;
    const names = sensors.filter((s) => s.kind !== "there").map((s) => ({ key: `plan ${s.name} ${s.kind}`, text: s.kind === "next" ? "next sensor?" : s.name, kind: `sensor plan-${s.kind}`, at: place(s) }));
    const worst = pairs.flatMap((pair) => {
      const ends = endsOf(pair, sensors);
      const text = `${pair.strong ? "interference" : "face to face"} ${Math.round(100 * pair.share)} %`;
      return ends && (pair.strong || pair.facing) ? [{ key: `pair ${pair.a} ${pair.b}`, text, kind: `plan-pair ${pair.strong ? "bad" : "warn"}`, at: ends[0].clone().lerp(ends[1], 0.5) }] : [];
    });
    return [...names, ...worst];
  }

  private rebuild(): void {
    for (const child of this.group.children) dispose(child);
    this.group.clear();
    if (!this.plan || !this.palette) return;
    this.group.add(floorOf(this.plan, this.palette));
    for (const sensor of this.plan.sensors) if (sensor.kind !== "there") this.group.add(sensorOf(sensor, this.palette));
    for (const pair of this.plan.pairs) {
      const ends = endsOf(pair, this.plan.sensors);
      if (ends && (pair.strong || pair.facing)) this.group.add(line(ends.flatMap((p) => p.toArray()), pair.strong ? this.palette.bad : this.palette.warn, 0.9, true));
    }
  }
}

function place({ rigid }: PlanMark): Vector3 {
  return new Vector3(rigid[3], rigid[7], rigid[11]);
}

function endsOf(pair: PlanPair, sensors: readonly PlanMark[]): [Vector3, Vector3] | null {
  const [a, b] = [pair.a, pair.b].map((name) => sensors.find((s) => s.kind !== "next" && s.name === name));
  return a && b ? [place(a), place(b)] : null;
}

/** The cells as one picture on the floor, or at the height that is looked at. */
function floorOf({ area, cellM, columns, rows, counts, heightM }: PlanShown, palette: Palette): Mesh {
  const pixels = new Uint8Array(4 * columns * rows);
  // Bytes of the style sheet's colours: the texture says that it is sRGB.
  const colours = palette.coverage.map((colour) => colour.clone().convertLinearToSRGB().toArray().map((v) => Math.round(255 * v)));
  for (let i = 0; i < counts.length; i++) {
    const class_ = Math.min(counts[i]!, CLASSES - 1);
    pixels.set([...colours[class_]!, class_ === 0 ? 110 : 255], 4 * i);
  }
  const texture = new DataTexture(pixels, columns, rows, RGBAFormat);
  texture.colorSpace = SRGBColorSpace;
  texture.magFilter = NearestFilter;
  texture.minFilter = NearestFilter;
  texture.needsUpdate = true;
  const [x, y, z] = [area.minX + columns * cellM, area.minY + rows * cellM, heightM + LIFT_M];
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute([area.minX, area.minY, z, x, area.minY, z, x, y, z, area.minX, y, z], 3));
  geometry.setAttribute("uv", new Float32BufferAttribute([0, 0, 1, 0, 1, 1, 0, 1], 2));
  geometry.setIndex([0, 1, 2, 0, 2, 3]);
  return new Mesh(geometry, new MeshBasicMaterial({ map: texture, transparent: true, opacity: OPACITY, side: DoubleSide, depthWrite: false }));
}

function sensorOf(mark: PlanMark, palette: Palette): Group {
  const object = new Group();
  const colour = mark.kind === "next" ? palette.next : palette.text;
  object.add(new LineSegments(BODY, new LineBasicMaterial({ color: colour })));
  const near: PlanMark = mark.kind === "next" ? mark : { ...mark, range: [0, CONE_M] };
  object.add(line(frustum(near), colour, mark.kind === "next" ? 0.8 : 0.5, true));
  object.applyMatrix4(matrixOf(mark.rigid));
  return object;
}

/** The edges of what a sensor measures, its own axes (x right, y down, z forward). */
function frustum({ fov, range }: PlanMark): number[] {
  const [x, y] = fov.map((deg) => Math.tan((Math.min(deg, 170) * Math.PI) / 360));
  const corners = (z: number) => [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => [a! * x! * z, b! * y! * z, z]);
  const [near, far] = [corners(range[0]), corners(range[1])];
  return near.flatMap((corner, i) => [...corner, ...far[i]!, ...corner, ...near[(i + 1) % 4]!, ...far[i]!, ...far[(i + 1) % 4]!]);
}

function line(points: number[], colour: Color, opacity: number, dashed: boolean): LineSegments {
  const geometry = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(points, 3));
  const look = { color: colour, transparent: true, opacity };
  return new LineSegments(geometry, dashed ? new LineDashedMaterial({ ...look, dashSize: 0.12, gapSize: 0.08 }) : new LineBasicMaterial(look)).computeLineDistances();
}

function dispose(object: { traverse(visit: (child: object) => void): void }): void {
  object.traverse((child) => {
    const mesh = child as Partial<Mesh>;
    if (mesh.geometry && mesh.geometry !== BODY) mesh.geometry.dispose();
    for (const material of [mesh.material].flat()) {
      (material as MeshBasicMaterial | undefined)?.map?.dispose();
      material?.dispose();
    }
  });
}
