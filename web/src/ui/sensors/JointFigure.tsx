// One sensor's part joint by joint, on a person seen from the front: the larger the dot the larger the figure, a ring
// around those that stand out.

import type { SensorStatus } from "../../gen/posefuse/v1/room_pb";
import { figure, fill, heatOf, jointParts, QUANTITIES, type Quantity } from "../../model/contribution";
import { FIGURE, FIGURE_JOINTS, jointLabel } from "../../model/figure";
import { BONES, JOINT_NAMES } from "../../model/joints";
import { quantity } from "../../state/prefs";

export function JointFigure({ sensor }: { sensor: SensorStatus }) {
  const parts = jointParts(sensor.contribution);
  const shown = quantity.value;
  const { label, unit, title } = QUANTITIES[shown];
  return (
    <div class="joint-figure">
      <QuantityChoice />
      <svg viewBox={`0 0 ${FIGURE.width} ${FIGURE.height}`} role="img" aria-label={`${label} of each joint. ${title}. The dialog Weights has the figures.`}>
        {BONES.map(([a, b]) => (
          <line key={`${a} ${b}`} x1={FIGURE_JOINTS[a]![0]} y1={FIGURE_JOINTS[a]![1]} x2={FIGURE_JOINTS[b]![0]} y2={FIGURE_JOINTS[b]![1]} />
        ))}
        {JOINT_NAMES.map((name, i) => {
          const value = parts[i]![shown];
          const [x, y] = FIGURE_JOINTS[i]!;
          const heat = heatOf(shown, value);
          return (
            <g key={name} class={`heat-${heat}`}>
              <title>
                {jointLabel(name)}: {figure(shown, value)} {value === null ? "" : unit}
              </title>
              <circle cx={x} cy={y} r={value === null ? 2 : 2 + 4.5 * Math.sqrt(fill(shown, value))} />
              {heat === "hot" && <circle class="ring" cx={x} cy={y} r={8.5} />}
            </g>
          );
        })}
        <text x="4" y="10">R</text>
        <text x={FIGURE.width - 4} y="10" text-anchor="end">L</text>
      </svg>
      <p class="muted">{title}: the larger the dot, the more.</p>
    </div>
  );
}

export function QuantityChoice() {
  return (
    <div class="segmented" role="group" aria-label="Figure shown">
      {(Object.keys(QUANTITIES) as Quantity[]).map((key) => (
        <button key={key} type="button" aria-pressed={quantity.value === key} title={QUANTITIES[key].title} data-testid={`quantity-${key}`} onClick={() => (quantity.value = key)}>
          {QUANTITIES[key].label}
        </button>
      ))}
    </div>
  );
}
