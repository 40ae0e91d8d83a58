// The floor that matters: found by itself, or as somebody measured it. Metres, room axes.

import type { Area } from "../../model/plan";
import { plan, planArea } from "../../state/plan";

interface Shape {
  /** Along x and along y. */
  sides: [number, number];
  middle: [number, number];
}

function shapeOf(area: Area): Shape {
  const round = (v: number) => Math.round(v * 100) / 100 || 0;
  return {
    sides: [round(area.maxX - area.minX), round(area.maxY - area.minY)],
    middle: [round((area.minX + area.maxX) / 2), round((area.minY + area.maxY) / 2)],
  };
}

function areaOf({ sides, middle }: Shape): Area {
  const [x, y] = sides.map((side) => Math.min(Math.max(side, 0.5), 50) / 2) as [number, number];
  return { minX: middle[0] - x, maxX: middle[0] + x, minY: middle[1] - y, maxY: middle[1] + y };
}

export function AreaFields() {
  const area = planArea.value ?? plan.value?.area;
  if (!area) return null;
  const shape = shapeOf(area);
  const given = planArea.value !== null;
  const set = (part: keyof Shape, axis: number, value: number) => {
    if (!Number.isFinite(value)) return;
    planArea.value = areaOf({ ...shape, [part]: shape[part].map((v, i) => (i === axis ? value : v)) });
  };
  const field = (part: keyof Shape, axis: number, words: string, short: string) => (
    <label>
      {short}
      <input
        type="number" step={0.5} min={part === "sides" ? 0.5 : undefined} max={part === "sides" ? 50 : undefined} disabled={!given} value={shape[part][axis]}
        aria-label={`${words}, metres`} data-testid={`plan-${part}-${axis}`} onChange={(e) => set(part, axis, e.currentTarget.valueAsNumber)}
      />
    </label>
  );
  return (
    <div class="plan-area">
      <label class="check">
        <input type="checkbox" checked={!given} data-testid="plan-auto" onChange={(e) => (planArea.value = e.currentTarget.checked ? null : areaOf(shape))} />
        Area about where the sensors look
      </label>
      <div class="plan-place" role="group" aria-label="Area">
        <span>sides</span>
        {field("sides", 0, "Length of the area along x", "x")}
        {field("sides", 1, "Length of the area along y", "y")}
      </div>
      <div class="plan-place" role="group" aria-label="Middle of the area">
        <span>middle</span>
        {field("middle", 0, "Middle of the area, x", "x")}
        {field("middle", 1, "Middle of the area, y", "y")}
      </div>
    </div>
  );
}
