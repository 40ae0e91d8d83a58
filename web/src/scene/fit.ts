// Where a camera must stand to see a set of points as large as possible.

import { Box3, Matrix4, Vector3, type PerspectiveCamera } from "three";

/** Share of the view left free at each side. */
export interface Margin {
  across: number;
  along: number;
}

const NEAREST = 2;

/** The camera's place and what it looks at, seen from `direction`; the view angle and aspect are the camera's own. */
export function frameAll(points: Vector3[], direction: Vector3, camera: PerspectiveCamera, margin: Margin): { to: Vector3; target: Vector3 } {
  const back = direction.clone().normalize();
  const basis = new Matrix4().lookAt(back, new Vector3(), camera.up);
  const right = new Vector3();
  const up = new Vector3();
  basis.extractBasis(right, up, new Vector3());
  const tanUp = Math.tan((camera.fov * Math.PI) / 360);
  const limit = { x: tanUp * camera.aspect * (1 - 2 * margin.across), y: tanUp * (1 - 2 * margin.along) };
  const target = new Box3().setFromPoints(points).getCenter(new Vector3());
  let distance = NEAREST;
  // Perspective makes the near side larger, so the middle of the picture is not the middle of the box: a few rounds
  // of measuring the picture and shifting the target centre it.
  for (let round = 0; round < 4; round++) {
    const seen = points.map((p) => p.clone().sub(target)).map((v) => ({ x: v.dot(right), y: v.dot(up), z: v.dot(back) }));
    distance = seen.reduce((d, s) => Math.max(d, s.z + Math.abs(s.x) / limit.x, s.z + Math.abs(s.y) / limit.y), NEAREST);
    const x = seen.map((s) => s.x / (distance - s.z));
    const y = seen.map((s) => s.y / (distance - s.z));
    target.addScaledVector(right, (distance * (Math.max(...x) + Math.min(...x))) / 2);
    target.addScaledVector(up, (distance * (Math.max(...y) + Math.min(...y))) / 2);
  }
  return { to: target.clone().addScaledVector(back, distance), target };
}
