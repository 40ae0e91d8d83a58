// The two plots under the room: how fast the followed person's joints move, and how well each
// sensor agrees or how far it has moved.

import { useState } from "preact/hooks";
import { PLOTTED_JOINTS } from "../model/joints";
import type { Series } from "../model/series";
import { SensorState } from "../gen/posefuse/v1/room_pb";
import { sensorColourName } from "../scene/palette";
import { DRIFT_SPAN, driftOf, residualOf, SPAN, speedsOf } from "../state/plots";
import { colourOf, followed, replay, shownSensors } from "../state/store";
import { Plot, type Line } from "./Plot";

/** Drawn from the start; the others are one press away, six lines at once are too many to read. */
const DRAWN = ["Pelvis", "L hand", "R hand"];

function speedLines(): Line[] {
  const series = speedsOf(followed.peek());
  return PLOTTED_JOINTS.map(({ label }, i) => ({ label, colour: `--plot-${i}`, mark: `plot-colour-${i}`, series: series[i], off: !DRAWN.includes(label) }));
}

/** What the second plot can show of each sensor. */
type Shown = "residual" | "others" | "moved";

const SHOWN: Record<Shown, { label: string; span: number; empty: string; series(name: string): Series | undefined }> = {
  residual: { label: "Residual", span: SPAN, empty: "No sensor's joints are compared with fused ones yet.", series: residualOf },
  others: {
    label: "Residual to the others", span: DRIFT_SPAN, empty: "No sensor is compared with the others yet.",
    series: (name) => driftOf(name)?.residual,
  },
  moved: {
    label: "Moved since calibrated", span: DRIFT_SPAN, empty: "Nothing can be said about drift yet.",
    series: (name) => driftOf(name)?.moved,
  },
};

const CHOICES = (Object.keys(SHOWN) as Shown[]).map((key) => ({ key, label: SHOWN[key].label }));

function sensorLines(shown: Shown): Line[] {
  return shownSensors.value.map((s) => {
    const name = s.info?.name ?? "";
    const colour = colourOf(name);
    const ended = s.state !== SensorState.LIVE;
    return { label: name, colour: sensorColourName(colour), mark: `sensor-colour-${colour}`, series: SHOWN[shown].series(name), ended };
  });
}

export function Plots() {
  const who = followed.value;
  const [shown, setShown] = useState<Shown>("residual");
  const { label, span, empty } = SHOWN[shown];
  return (
    <div class="plots">
      <Plot
        title={who === null ? "Joint speed" : `Joint speed, person ${who}`}
        unit="m/s" digits={2} floor={1} span={SPAN} testid="plot-speed" lines={speedLines}
        empty="Nobody to follow."
      />
      <Plot
        key={shown}
        title={label} choices={CHOICES} onChoose={(key) => setShown(key as Shown)}
        unit={replay.value ? "mm, live room" : "mm"} digits={0} floor={20} span={span} testid="plot-residual" lines={() => sensorLines(shown)}
        empty={empty}
      />
    </div>
  );
}
