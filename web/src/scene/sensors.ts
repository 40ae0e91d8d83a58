// Sensors where the calibration puts them: a small camera body and the cone it sees; outlines only where a sensor is
// muted. Built in the sensor's own frame (x right, y down, z forward) and placed by `room_from_sensor`.

import {
  BoxGeometry, BufferGeometry, Color, CylinderGeometry, DoubleSide, EdgesGeometry, Float32BufferAttribute, Group,
  LineBasicMaterial, LineDashedMaterial, LineSegments, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, Vector3,
} from "three";
import type { Rigid } from "../model/raw";
import type { Palette } from "./palette";

export interface SensorMark {
  id: number;
  name: string;
  /** 0 to 6. */
  colour: number;
  rigid: Rigid;
  /** Degrees; 0 where unknown, then no cone is drawn. */
  fovHorizontal: number;
  fovVertical: number;
  /** Whether it delivers at present. */
  live: boolean;
  /** Left out of fusing: drawn hollow. */
  muted: boolean;
}

/** How far the drawn cone reaches, metres: enough to tell where a sensor looks, short enough not to fill the room. */
const CONE_M = 1.5;

const BODY = new BoxGeometry(0.24, 0.06, 0.06);
const OUTLINE = new EdgesGeometry(BODY);
const LENS = new CylinderGeometry(0.022, 0.022, 0.03, 16).rotateX(Math.PI / 2).translate(0.05, 0, 0.04);

export class SensorsView {
  readonly group = new Group();
  private palette: Palette | null = null;
  private marks: SensorMark[] = [];
  private drawn = "";
  private cones = true;

  paint(palette: Palette): void {
    this.palette = palette;
    this.rebuild();
  }

  set showCones(on: boolean) {
    this.cones = on;
    for (const object of this.group.children) {
      const cone = object.getObjectByName("cone");
      if (cone) cone.visible = on;
    }
  }

  update(marks: SensorMark[]): void {
    const key = JSON.stringify(marks.map((m) => ({ ...m, rigid: [...m.rigid] })));
    if (key === this.drawn) return;
    this.drawn = key;
    this.marks = marks;
    this.rebuild();
  }

  private rebuild(): void {
    if (!this.palette) return;
    for (const object of this.group.children) dispose(object as Group);
    this.group.clear();
    for (const mark of this.marks) this.group.add(this.build(mark, this.palette));
  }

  private build(mark: SensorMark, palette: Palette): Group {
    const object = new Group();
    const colour = mark.live ? palette.sensors[mark.colour]! : palette.dead;
    if (mark.muted) {
      object.add(new LineSegments(OUTLINE, new LineBasicMaterial({ color: colour })));
    } else {
      object.add(new Mesh(BODY, new MeshLambertMaterial({ color: colour })));
      object.add(new Mesh(LENS, new MeshLambertMaterial({ color: new Color(0x15181b) })));
    }
    if (mark.fovHorizontal > 0 && mark.fovVertical > 0) {
      const cone = coneOf(mark, colour);
      cone.visible = this.cones;
      object.add(cone);
    }
    object.applyMatrix4(matrixOf(mark.rigid));
    return object;
  }
}

export function matrixOf(m: Rigid): Matrix4 {
  return new Matrix4().set(
    m[0]!, m[1]!, m[2]!, m[3]!, m[4]!, m[5]!, m[6]!, m[7]!, m[8]!, m[9]!, m[10]!, m[11]!, 0, 0, 0, 1,
  );
}

/** Where a sensor's name goes; the style sheet lifts it above the body. */
export function labelPlace(mark: SensorMark): Vector3 {
  return new Vector3(mark.rigid[3], mark.rigid[7], mark.rigid[11]);
}

function coneOf(mark: SensorMark, colour: Color): Group {
  const half = (deg: number) => CONE_M * Math.tan((Math.min(deg, 170) * Math.PI) / 360);
  const x = half(mark.fovHorizontal);
  const y = half(mark.fovVertical);
  const corners: [number, number, number][] = [[-x, -y, CONE_M], [x, -y, CONE_M], [x, y, CONE_M], [-x, y, CONE_M]];
  const edges: number[] = [];
  const faces: number[] = [];
  corners.forEach((corner, i) => {
    const next = corners[(i + 1) % 4]!;
    edges.push(0, 0, 0, ...corner, ...corner, ...next);
    faces.push(0, 0, 0, ...corner, ...next);
  });
  const cone = new Group();
  cone.name = "cone";
  const opacity = mark.live ? 1 : 0.4;
  if (mark.muted) {
    const dashes = { color: colour, transparent: true, opacity: 0.35 * opacity, dashSize: 0.08, gapSize: 0.08 };
    cone.add(new LineSegments(geometry(edges), new LineDashedMaterial(dashes)).computeLineDistances());
    return cone;
  }
  cone.add(
    new LineSegments(geometry(edges), new LineBasicMaterial({ color: colour, transparent: true, opacity: 0.45 * opacity })),
    new Mesh(geometry(faces), new MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.035 * opacity, side: DoubleSide, depthWrite: false })),
  );
  return cone;
}

function geometry(points: number[]): BufferGeometry {
  return new BufferGeometry().setAttribute("position", new Float32BufferAttribute(points, 3));
}

const SHARED = new Set<BufferGeometry>([BODY, LENS, OUTLINE]);

function dispose(object: Group): void {
  object.traverse((child) => {
    const mesh = child as Partial<Mesh>;
    if (mesh.geometry && !SHARED.has(mesh.geometry)) mesh.geometry.dispose();
    for (const material of [mesh.material].flat()) material?.dispose();
  });
}
