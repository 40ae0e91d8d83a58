// Fused people: a mark for each joint, a stick for each bone, and a halo of two standard deviations. The shape of a
// mark tells its provenance as its colour does: sphere measured, cube inferred, octahedron repaired.

import {
  BoxGeometry, BufferGeometry, Color, CylinderGeometry, DynamicDrawUsage, Group, InstancedMesh, type Material, Matrix4,
  MeshBasicMaterial, MeshLambertMaterial, OctahedronGeometry, Quaternion, SphereGeometry, Vector3,
} from "three";
import { worse, type Frame, type Joint, type Person, type Source } from "../model/frame";
import { BONES, JOINT_COUNT } from "../model/joints";
import type { Palette } from "./palette";

const MAX_PEOPLE = 16;
const JOINTS = MAX_PEOPLE * JOINT_COUNT;
const SOURCES: Source[] = ["measured", "inferred", "repaired"];
const MARK_M = 0.03;
const BONE_M = 0.014;
/** A halo smaller than its mark would not be seen, a larger one than this would hide the person. */
const HALO_MAX_M = 0.6;
const HALO_SIGMAS = 2;
const UP = new Vector3(0, 1, 0);

export class PeopleView {
  readonly group = new Group();
  private marks: Record<Source, InstancedMesh<BufferGeometry, MeshLambertMaterial>>;
  private bones: InstancedMesh<BufferGeometry, MeshLambertMaterial>;
  private halos: InstancedMesh<BufferGeometry, MeshBasicMaterial>;
  private colours: Record<Source, Color> = { measured: new Color(), inferred: new Color(), repaired: new Color() };

  constructor() {
    const mark = (geometry: BufferGeometry) => instanced(geometry, new MeshLambertMaterial(), JOINTS);
    this.marks = {
      measured: mark(new SphereGeometry(MARK_M, 16, 12)),
      inferred: mark(new BoxGeometry(MARK_M * 1.7, MARK_M * 1.7, MARK_M * 1.7)),
      repaired: mark(new OctahedronGeometry(MARK_M * 1.5)),
    };
    this.bones = instanced(new CylinderGeometry(BONE_M, BONE_M, 1, 8, 1), new MeshLambertMaterial(), JOINTS);
    this.halos = instanced(
      new SphereGeometry(1, 16, 12),
      new MeshBasicMaterial({ transparent: true, opacity: 0.14, depthWrite: false }),
      JOINTS,
    );
    this.halos.renderOrder = 2;
    this.group.add(this.bones, this.halos, ...SOURCES.map((s) => this.marks[s]));
  }

  set showHalos(on: boolean) {
    this.halos.visible = on;
  }

  paint(palette: Palette): void {
    this.colours = palette.sources;
  }

  /** `followed` is drawn a little stronger than the others. */
  update(frame: Frame, followed: string | null): void {
    const counts = { measured: 0, inferred: 0, repaired: 0, bones: 0, halos: 0 };
    for (const person of frame.people.slice(0, MAX_PEOPLE)) {
      const size = person.id === followed && frame.people.length > 1 ? 1.25 : 1;
      this.addMarks(person, size, counts);
      this.addBones(person, size, counts);
    }
    for (const source of SOURCES) finish(this.marks[source], counts[source]);
    finish(this.bones, counts.bones);
    finish(this.halos, counts.halos);
  }

  private addMarks(person: Person, size: number, counts: Record<Source | "bones" | "halos", number>): void {
    for (const joint of person.joints) {
      if (!joint) continue;
      matrix.makeScale(size, size, size).setPosition(joint.x, joint.y, joint.z);
      const mesh = this.marks[joint.source];
      mesh.setMatrixAt(counts[joint.source], matrix);
      mesh.setColorAt(counts[joint.source]++, this.colours[joint.source]);
      if (joint.spread) {
        this.halos.setMatrixAt(counts.halos, haloMatrix(joint));
        this.halos.setColorAt(counts.halos++, this.colours[joint.source]);
      }
    }
  }

  private addBones(person: Person, size: number, counts: { bones: number }): void {
    for (const [a, b] of BONES) {
      const from = person.joints[a];
      const to = person.joints[b];
      if (!from || !to) continue;
      this.bones.setMatrixAt(counts.bones, stickMatrix(from, to, size));
      this.bones.setColorAt(counts.bones++, this.colours[worse(from.source, to.source)]);
    }
  }
}

const matrix = new Matrix4();
const start = new Vector3();
const along = new Vector3();
const turn = new Quaternion();
const scale = new Vector3();

function stickMatrix(from: Joint, to: Joint, size: number): Matrix4 {
  start.set(from.x, from.y, from.z);
  along.set(to.x, to.y, to.z).sub(start);
  const length = along.length();
  start.addScaledVector(along, 0.5);
  turn.setFromUnitVectors(UP, length > 1e-6 ? along.divideScalar(length) : UP);
  return matrix.compose(start, turn, scale.set(size, Math.max(length, 1e-6), size));
}

function haloMatrix(joint: Joint): Matrix4 {
  const { axes, sigmas } = joint.spread!;
  const r = [0, 1, 2].map((i) => Math.min(Math.max(HALO_SIGMAS * sigmas[i]!, 1e-4), HALO_MAX_M)) as [number, number, number];
  return matrix.set(
    axes[0]! * r[0], axes[3]! * r[1], axes[6]! * r[2], joint.x,
    axes[1]! * r[0], axes[4]! * r[1], axes[7]! * r[2], joint.y,
    axes[2]! * r[0], axes[5]! * r[1], axes[8]! * r[2], joint.z,
    0, 0, 0, 1,
  );
}

function instanced<M extends Material>(geometry: BufferGeometry, material: M, count: number): InstancedMesh<BufferGeometry, M> {
  const mesh = new InstancedMesh(geometry, material, count);
  mesh.instanceMatrix.setUsage(DynamicDrawUsage);
  mesh.setColorAt(0, new Color());
  mesh.count = 0;
  mesh.frustumCulled = false;
  return mesh;
}

function finish(mesh: InstancedMesh, count: number): void {
  mesh.count = count;
  mesh.instanceMatrix.needsUpdate = true;
  if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
}
