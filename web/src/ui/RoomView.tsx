// The 3D view with what lies over it: view buttons, who is in the room, legend, and words when there is nothing to see.

import { useSignalEffect } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { SensorState } from "../gen/posefuse/v1/room_pb";
import { dateTime, plural } from "../model/format";
import { rigidOf } from "../model/raw";
import type { Cloud } from "../scene/cloud";
import type { SensorMark } from "../scene/sensors";
import { RoomScene, type Preset } from "../scene/room";
import { depthClouds } from "../state/depth";
import { planOpen, planShown } from "../state/plan";
import { reducedMotion, resolvedTheme } from "../state/prefs";
import { replayPlaces } from "../state/replay";
import { chosenId, colourOf, connection, followed, frames, peopleIds, rawBodies, replay, sensors, show } from "../state/store";
import { Empty } from "./Empty";
import { Legend } from "./Legend";
import { PlanLegend } from "./plan/Legend";
import { view } from "./keys";

const PRESETS: { preset: Preset; label: string; key: string }[] = [
  { preset: "front", label: "Front", key: "1" },
  { preset: "top", label: "Top", key: "2" },
  { preset: "side", label: "Side", key: "3" },
  { preset: "fit", label: "Fit", key: "F" },
];

export function RoomView() {
  const host = useRef<HTMLDivElement>(null);
  const labels = useRef<HTMLDivElement>(null);
  const scene = useRef<RoomScene | null>(null);
  const [trouble, setTrouble] = useState("");
  useEffect(() => {
    try {
      scene.current = new RoomScene(host.current!, labels.current!, (id) => (chosenId.value = id));
    } catch {
      setTrouble("This browser gives no WebGL 2, which the 3D view needs. Turn on hardware acceleration or use another browser; everything else on this page works.");
      return;
    }
    view.look = (preset) => scene.current?.look(preset, reducedMotion());
    const stops = [
      frames.on((frame) => scene.current?.setFrame(frame, followed.value)),
      rawBodies.on((bodies) => scene.current?.setRaw([...bodies.values()].flat())),
      depthClouds.on(() => showClouds(scene.current)),
    ];
    return () => {
      stops.forEach((stop) => stop());
      view.look = () => undefined;
      scene.current?.dispose();
      scene.current = null;
    };
  }, []);
  useSceneState(scene);
  return (
    <section class={`view ${connection.value.kind === "offline" ? "stale" : ""} ${replay.value ? "replaying" : ""}`} aria-label="3D view of the room">
      <div
        class="stage"
        ref={host}
        tabIndex={0}
        role="application"
        aria-label="Room. Arrow keys turn the view, plus and minus zoom."
        data-testid="stage"
        onKeyDown={(event) => scene.current && steer(scene.current, event)}
      >
        <div class="labels" ref={labels} />
      </div>
      <div class="view-top">
        <People />
        <ViewButtons />
      </div>
      {replay.value && <ReplayBanner />}
      {trouble ? <p class="view-message" role="alert">{trouble}</p> : <Empty />}
      {planOpen.value && <PlanLegend />}
      <Legend />
    </section>
  );
}

/** Hands what changes rarely to the scene. */
function useSceneState(scene: { current: RoomScene | null }): void {
  useSignalEffect(() => {
    const marks = replay.value ? replayMarks() : liveMarks();
    scene.current?.setSensors(marks, reducedMotion());
  });
  useSignalEffect(() => scene.current?.setShown({ halos: show.halos.value, cones: show.cones.value, labels: show.labels.value }));
  useSignalEffect(() => {
    if (show.clouds.value || sensors.value) showClouds(scene.current);
  });
  useSignalEffect(() => scene.current?.setPlan(planShown.value, reducedMotion()));
  useSignalEffect(() => scene.current?.setFrame(frames.value, followed.value));
  useSignalEffect(() => {
    if (resolvedTheme.value) scene.current?.paint();
  });
}

/** Depth in the room, of the sensors whose preview is open and whose place is known. */
function showClouds(scene: RoomScene | null): void {
  const clouds: Cloud[] = [];
  for (const s of show.clouds.peek() && !replay.peek() ? sensors.peek() : []) {
    const name = s.info?.name ?? "";
    const [image, rigid] = [depthClouds.value.get(name), rigidOf(s.roomFromSensor)];
    if (image && rigid) clouds.push({ sensor: name, colour: colourOf(name), rigid, image });
  }
  scene?.setClouds(clouds);
}

function liveMarks(): SensorMark[] {
  const marks: SensorMark[] = [];
  for (const s of sensors.value) {
    const rigid = rigidOf(s.roomFromSensor);
    if (!rigid || !s.info) continue;
    marks.push({
      id: s.info.id, name: s.info.name, colour: colourOf(s.info.name), rigid,
      fovHorizontal: s.fovHorizontalDeg, fovVertical: s.fovVerticalDeg, live: s.state === SensorState.LIVE, muted: s.muted,
    });
  }
  return marks;
}

function replayMarks(): SensorMark[] {
  return [...replayPlaces.value].map(([id, { name, rigid }]) => {
    // A take does not say what its sensors could see; the same sensor in the live room does.
    const known = sensors.peek().find((s) => s.info?.name === name);
    return { id, name, colour: colourOf(name), rigid, fovHorizontal: known?.fovHorizontalDeg ?? 0, fovVertical: known?.fovVerticalDeg ?? 0, live: true, muted: false };
  });
}

function steer(scene: RoomScene, event: KeyboardEvent): void {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const arrows: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const arrow = arrows[event.key];
  if (arrow && event.shiftKey) scene.pan(arrow[0] * 0.05, arrow[1] * 0.05);
  else if (arrow) scene.orbit(arrow[0] * 6, -arrow[1] * 6);
  else if (event.key === "+" || event.key === "=") scene.zoom(0.88);
  else if (event.key === "-") scene.zoom(1 / 0.88);
  else return;
  event.preventDefault();
}

function ReplayBanner() {
  const r = replay.value!;
  return (
    <p class="replay-banner" role="status" data-testid="replay-banner">
      <strong>REPLAY</strong> {r.take.name} <span class="replay-when">recorded {dateTime(r.take.started)}</span>
    </p>
  );
}

function People() {
  const ids = peopleIds.value;
  return (
    <div class="people" role="radiogroup" aria-label="Person followed in the plots">
      <span class="people-count" role="status" data-testid="people-count">
        {plural(ids.length, "person", "people")}
      </span>
      {ids.map((id) => (
        <button
          key={id}
          type="button"
          role="radio"
          aria-checked={id === followed.value}
          aria-label={`Person ${id}`}
          class="chip"
          data-testid="person-chip"
          onClick={() => (chosenId.value = id)}
        >
          {id}
        </button>
      ))}
    </div>
  );
}

function ViewButtons() {
  return (
    <div class="view-buttons">
      <div class="segmented" role="group" aria-label="View from">
        {PRESETS.map(({ preset, label, key }) => (
          <button key={preset} type="button" title={`${label} (${key})`} aria-keyshortcuts={key} data-testid={`view-${preset}`} onClick={() => view.look(preset)}>
            {label}
          </button>
        ))}
      </div>
      <div class="segmented" role="group" aria-label="Show">
        <Toggle on={show.raw} label="Raw" hint="W" testid="toggle-raw" title="Raw skeletons of the sensors" />
        <Toggle on={show.halos} label="Halos" hint="U" testid="toggle-halos" title="Uncertainty, two standard deviations" />
        <Toggle on={show.cones} label="Cones" hint="C" testid="toggle-cones" title="What the sensors see" />
        <Toggle on={show.clouds} label="Depth" hint="D" testid="toggle-clouds" title="Depth of the sensors whose preview is open" />
        <Toggle on={show.labels} label="Labels" hint="L" testid="toggle-labels" title="Names of people and sensors" />
      </div>
      <div class="segmented" role="group" aria-label="Planning">
        <Toggle on={planOpen} label="Plan" hint="O" testid="plan-button" title="Plan where sensors stand: what they see, and who disturbs whom" />
      </div>
    </div>
  );
}

function Toggle(props: { on: { value: boolean }; label: string; hint: string; testid: string; title: string }) {
  return (
    <button
      type="button"
      aria-pressed={props.on.value}
      aria-keyshortcuts={props.hint}
      title={`${props.title} (${props.hint})`}
      data-testid={props.testid}
      onClick={() => (props.on.value = !props.on.value)}
    >
      {props.label}
    </button>
  );
}
