// The two plots under the room: how fast the followed person's joints move, and how well each sensor agrees.

import { PLOTTED_JOINTS } from "../model/joints";
import { SensorState } from "../gen/posefuse/v1/room_pb";
import { sensorColourName } from "../scene/palette";
import { residualOf, SPAN, speedsOf } from "../state/plots";
import { colourOf, followed, replay, shownSensors } from "../state/store";
import { Plot, type Line } from "./Plot";

/** Drawn from the start; the others are one press away, six lines at once are too many to read. */
const DRAWN = ["Pelvis", "L hand", "R hand"];

function speedLines(): Line[] {
  const series = speedsOf(followed.peek());
  return PLOTTED_JOINTS.map(({ label }, i) => ({ label, colour: `--plot-${i}`, mark: `plot-colour-${i}`, series: series[i], off: !DRAWN.includes(label) }));
}

function residualLines(): Line[] {
  return shownSensors.value.map((s) => {
    const name = s.info?.name ?? "";
    const colour = colourOf(name);
    const ended = s.state !== SensorState.LIVE;
    return { label: name, colour: sensorColourName(colour), mark: `sensor-colour-${colour}`, series: residualOf(name), ended };
  });
}

export function Plots() {
  const who = followed.value;
  return (
    <div class="plots">
      <Plot
        title={who === null ? "Joint speed" : `Joint speed, person ${who}`}
        unit="m/s" digits={2} floor={1} span={SPAN} testid="plot-speed" lines={speedLines}
        empty="Nobody to follow."
      />
      <Plot
        title={replay.value ? "Residual, live room" : "Residual"}
        unit="mm" digits={0} floor={20} span={SPAN} testid="plot-residual" lines={residualLines}
        empty="No sensor's joints are compared with fused ones yet."
      />
    </div>
  );
}
