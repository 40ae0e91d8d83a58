// The 3D room: camera, light, and what is drawn in it. Metres, Z up. Renders only when something has changed.

import { AmbientLight, DirectionalLight, PerspectiveCamera, Scene, Spherical, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Frame } from "../model/frame";
import type { PlanShown } from "../model/plan";
import type { RawBody } from "../model/raw";
import { CloudView, type Cloud } from "./cloud";
import { AXIS_TIPS, Floor } from "./floor";
import { frameAll } from "./fit";
import { Labels, type Label } from "./labels";
import { readPalette } from "./palette";
import { PeopleView } from "./people";
import { PlanView } from "./plan";
import { RawView } from "./raw";
import { labelPlace, SensorsView, type SensorMark } from "./sensors";

export type Preset = "front" | "top" | "side" | "fit";

/** Where the camera stands, seen from what it looks at. Front looks the person in the face (the room's -x). */
const DIRECTIONS: Record<Preset, Vector3> = {
  front: new Vector3(1, 0, 0.12),
  side: new Vector3(0, -1, 0.12),
  // Not straight down: x then points up on the screen.
  top: new Vector3(-0.001, 0, 1),
  fit: new Vector3(0.75, -0.9, 0.62),
};
/** Names, buttons and the legend lie over the edges of the view. */
const MARGIN_PX = { across: 64, along: 80 };
const FLIGHT_MS = 280;

export class RoomScene {
  readonly canvas: HTMLCanvasElement;
  private renderer: WebGLRenderer;
  private scene = new Scene();
  private camera = new PerspectiveCamera(40, 1, 0.05, 100);
  private controls: OrbitControls;
  private floor = new Floor();
  private people = new PeopleView();
  private raw = new RawView();
  private sensors = new SensorsView();
  private clouds = new CloudView();
  private plan = new PlanView();
  private labels: Labels;
  private marks: SensorMark[] = [];
  private frame: Frame = { time: 0, people: [], malformed: 0 };
  private followed: string | null = null;
  private planned: PlanShown | null = null;
  private labelsShown = true;
  private dirty = true;
  private running = true;
  private flight: { from: Vector3; to: Vector3; fromTarget: Vector3; toTarget: Vector3; since: number } | null = null;
  /** The preset that is kept when the view changes its size, until somebody moves the camera. */
  private kept: Preset | null = "fit";
  private size = { width: 1, height: 1 };
  private resizer: ResizeObserver;

  /** Throws when the browser gives no WebGL. */
  constructor(private host: HTMLElement, labelHost: HTMLElement, private choose: (id: string) => void) {
    this.renderer = new WebGLRenderer({ antialias: true, powerPreference: "low-power" });
    this.canvas = this.renderer.domElement;
    host.prepend(this.canvas);
    this.labels = new Labels(labelHost);
    this.camera.up.set(0, 0, 1);
    this.camera.position.copy(DIRECTIONS.fit).multiplyScalar(6);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.target.set(0, 0, 0.9);
    this.controls.maxPolarAngle = Math.PI * 0.52;
    this.controls.minDistance = 0.6;
    this.controls.maxDistance = 40;
    this.controls.addEventListener("change", () => (this.dirty = true));
    this.controls.addEventListener("start", () => this.moved());
    this.controls.update();
    const key = new DirectionalLight(0xffffff, 2);
    key.position.set(3, -4, 8);
    this.scene.add(new AmbientLight(0xffffff, 1.6), key, this.floor.group, this.sensors.group, this.raw.group, this.people.group, this.clouds.group, this.plan.group);
    this.resizer = new ResizeObserver(() => this.resize());
    this.resizer.observe(host);
    this.resize();
    this.paint();
    const loop = () => {
      if (!this.running) return;
      requestAnimationFrame(loop);
      this.draw();
    };
    loop();
  }

  dispose(): void {
    this.running = false;
    this.resizer.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
    this.canvas.remove();
  }

  /** Takes the colours of the theme in force. */
  paint(): void {
    const palette = readPalette();
    this.scene.background = palette.background;
    for (const part of [this.floor, this.people, this.raw, this.sensors, this.clouds, this.plan]) part.paint(palette);
    this.setFrame(this.frame, this.followed);
  }

  setFrame(frame: Frame, followed: string | null): void {
    this.frame = frame;
    this.followed = followed;
    this.people.update(frame, followed);
    this.host.dataset["people"] = String(frame.people.length);
    this.name();
  }

  /** Sensors that come or move, as by a new calibration, are brought into view unless somebody has moved the camera. */
  setSensors(marks: SensorMark[], still: boolean): void {
    const places = (list: SensorMark[]) => list.map((m) => m.rigid.join()).join(";");
    const moved = places(marks) !== places(this.marks);
    this.marks = marks;
    this.sensors.update(marks);
    this.host.dataset["muted"] = String(marks.filter((m) => m.muted).length);
    this.name();
    if (moved && this.kept) this.look(this.kept, still);
  }

  setRaw(bodies: readonly RawBody[]): void {
    this.host.dataset["raw"] = String(this.raw.update(bodies));
    this.dirty = true;
  }

  setClouds(clouds: readonly Cloud[]): void {
    this.host.dataset["cloud"] = String(this.clouds.update(clouds));
    this.dirty = true;
  }

  /** Shows a plan of the room, or none; what comes or moves is brought into view unless somebody has moved the camera. */
  setPlan(plan: PlanShown | null, still: boolean): void {
    const places = (shown: PlanShown | null) => JSON.stringify([shown?.area, shown?.sensors.map((s) => [...s.rigid])]);
    const came = plan !== null && places(plan) !== places(this.planned);
    this.planned = plan;
    this.plan.update(plan);
    this.host.dataset["plan"] = String(plan?.sensors.length ?? "");
    this.name();
    if (came && this.kept) this.look(this.kept, still);
  }

  setShown(shown: { halos: boolean; cones: boolean; labels: boolean }): void {
    this.people.showHalos = shown.halos;
    this.sensors.showCones = shown.cones;
    this.labelsShown = shown.labels;
    this.name();
  }

  private name(): void {
    const labels: Label[] = [];
    if (this.labelsShown) {
      for (const tip of AXIS_TIPS) labels.push({ key: `axis ${tip.name}`, text: tip.name, kind: `axis axis-${tip.name}`, at: tip.at });
      for (const mark of this.marks) {
        const text = `${mark.name}${mark.muted ? " (muted)" : ""}${mark.live ? "" : " ⚠"}`;
        labels.push({ key: `sensor ${mark.id}`, text, kind: mark.live ? "sensor" : "sensor dead", at: labelPlace(mark) });
      }
      labels.push(...this.plan.labels());
      for (const person of this.frame.people) {
        const at = topOf(person.joints);
        if (!at) continue;
        const kind = person.id === this.followed ? "person followed" : "person";
        labels.push({ key: `person ${person.id}`, text: person.id, kind, at, press: () => this.choose(person.id) });
      }
    }
    this.labels.set(labels);
    this.dirty = true;
  }

  look(preset: Preset, still: boolean): void {
    const { width, height } = this.size;
    const margin = { across: Math.min(MARGIN_PX.across / width, 0.2), along: Math.min(MARGIN_PX.along / height, 0.3) };
    const { to, target: toTarget } = frameAll(this.points(), DIRECTIONS[preset], this.camera, margin);
    this.kept = preset;
    const flight = { from: this.camera.position.clone(), to, fromTarget: this.controls.target.clone(), toTarget, since: performance.now() };
    this.flight = still ? { ...flight, since: -Infinity } : flight;
    this.dirty = true;
  }

  /** Turns the camera about what it looks at, degrees. */
  orbit(azimuthDeg: number, polarDeg: number): void {
    const s = this.spherical();
    s.theta += (azimuthDeg * Math.PI) / 180;
    s.phi = Math.min(Math.max(s.phi + (polarDeg * Math.PI) / 180, 0.01), this.controls.maxPolarAngle);
    this.apply(s);
  }

  zoom(factor: number): void {
    const s = this.spherical();
    s.radius = Math.min(Math.max(s.radius * factor, this.controls.minDistance), this.controls.maxDistance);
    this.apply(s);
  }

  /** Moves what is looked at over the screen, in shares of the distance. */
  pan(right: number, up: number): void {
    this.moved();
    const distance = this.camera.position.distanceTo(this.controls.target);
    const x = new Vector3().setFromMatrixColumn(this.camera.matrix, 0);
    const y = new Vector3().setFromMatrixColumn(this.camera.matrix, 1);
    const move = x.multiplyScalar(right * distance).addScaledVector(y, up * distance);
    this.camera.position.add(move);
    this.controls.target.add(move);
    this.controls.update();
    this.dirty = true;
  }

  // Spherical of three.js measures from +y; the room's up is +z.
  private spherical(): Spherical {
    const v = this.camera.position.clone().sub(this.controls.target);
    return new Spherical().setFromVector3(new Vector3(v.x, v.z, -v.y));
  }

  private moved(): void {
    this.flight = null;
    this.kept = null;
  }

  private apply(s: Spherical): void {
    this.moved();
    const v = new Vector3().setFromSpherical(s);
    this.camera.position.set(v.x, -v.z, v.y).add(this.controls.target);
    this.controls.update();
    this.dirty = true;
  }

  /** What a view must hold: sensors with their names, people, the origin. */
  private points(): Vector3[] {
    const points = [new Vector3(0, 0, 0)];
    for (const mark of this.marks) points.push(labelPlace(mark));
    for (const { joints } of this.frame.people) {
      for (const joint of joints) if (joint) points.push(new Vector3(joint.x, joint.y, joint.z));
    }
    points.push(...this.plan.points());
    if (this.marks.length === 0 && !this.planned) points.push(new Vector3(-2, -2, 0), new Vector3(2, -2, 0), new Vector3(-2, 2, 0), new Vector3(2, 2, 1.8));
    return points;
  }

  private resize(): void {
    const width = Math.max(this.host.clientWidth, 1);
    const height = Math.max(this.host.clientHeight, 1);
    this.size = { width, height };
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.kept) this.look(this.kept, true);
    // A new size empties the canvas; waiting for the next animation frame would show it so.
    this.dirty = true;
    this.draw();
  }

  private draw(): void {
    if (this.flight) this.fly();
    if (!this.dirty) return;
    this.dirty = false;
    this.renderer.render(this.scene, this.camera);
    this.labels.place(this.camera, this.size.width, this.size.height);
  }

  private fly(): void {
    const flight = this.flight!;
    const t = Math.min((performance.now() - flight.since) / FLIGHT_MS, 1);
    const ease = 1 - (1 - t) ** 3;
    this.camera.position.lerpVectors(flight.from, flight.to, ease);
    this.controls.target.lerpVectors(flight.fromTarget, flight.toTarget, ease);
    this.controls.update();
    this.dirty = true;
    if (t >= 1) this.flight = null;
  }
}

function topOf(joints: Frame["people"][number]["joints"]): Vector3 | null {
  let top: Vector3 | null = null;
  for (const joint of joints) if (joint && (!top || joint.z > top.z)) top = new Vector3(joint.x, joint.y, joint.z);
  return top?.setZ(top.z + 0.18) ?? null;
}
