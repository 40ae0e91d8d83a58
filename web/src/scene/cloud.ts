// What the sensors see, as faint points placed by the calibration: a sensor that is not where the calibration says shows
// at once, since its floor and walls do not fall together with the others'.

import { BufferAttribute, BufferGeometry, DynamicDrawUsage, Group, Points, PointsMaterial } from "three";
import type { DepthImage } from "../model/depth";
import type { Rigid } from "../model/raw";
import type { Palette } from "./palette";
import { matrixOf } from "./sensors";

export interface Cloud {
  sensor: string;
  /** The sensor's colour, 0 to 6. */
  colour: number;
  rigid: Rigid;
  image: DepthImage;
}

export class CloudView {
  readonly group = new Group();
  private clouds = new Map<string, Points<BufferGeometry, PointsMaterial>>();
  private palette: Palette | null = null;

  paint(palette: Palette): void {
    this.palette = palette;
  }

  /** Returns how many points are drawn. */
  update(clouds: readonly Cloud[]): number {
    for (const [sensor, points] of this.clouds) {
      if (clouds.some((cloud) => cloud.sensor === sensor)) continue;
      this.group.remove(points);
      points.geometry.dispose();
      points.material.dispose();
      this.clouds.delete(sensor);
    }
    return clouds.reduce((sum, cloud) => sum + this.place(cloud), 0);
  }

  private place({ sensor, colour, rigid, image }: Cloud): number {
    let points = this.clouds.get(sensor);
    if (!points) {
      points = new Points(new BufferGeometry(), new PointsMaterial({ size: 0.016, transparent: true, opacity: 0.55, depthWrite: false }));
      points.frustumCulled = false;
      points.matrixAutoUpdate = false;
      this.clouds.set(sensor, points);
      this.group.add(points);
    }
    if (this.palette) points.material.color = this.palette.sensors[colour]!;
    points.matrix.copy(matrixOf(rigid));
    const count = fill(points.geometry, image);
    points.geometry.setDrawRange(0, count);
    return count;
  }
}

function fill(geometry: BufferGeometry, { width, millimetres, camera }: DepthImage): number {
  let at = geometry.getAttribute("position") as BufferAttribute | undefined;
  if (!at || at.count < millimetres.length) {
    at = new BufferAttribute(new Float32Array(3 * millimetres.length), 3).setUsage(DynamicDrawUsage);
    geometry.setAttribute("position", at);
  }
  let count = 0;
  for (let i = 0; i < millimetres.length; i++) {
    const z = millimetres[i]! / 1000;
    if (z === 0) continue;
    at.setXYZ(count++, (((i % width) - camera.cx) / camera.fx) * z, ((Math.floor(i / width) - camera.cy) / camera.fy) * z, z);
  }
  at.needsUpdate = true;
  return count;
}
