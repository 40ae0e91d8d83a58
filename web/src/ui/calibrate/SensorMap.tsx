// One sensor's view from above: its cone, the floor cells in which it saw somebody, and where somebody is now. The
// sensor stands at the bottom and looks up, as from behind it.

import type { SensorProgress } from "../../gen/posefuse/v1/room_pb";
import { CELL_M, cellsOf, coneOf, extentOf, type Grade } from "../../model/coverage";
import { spots } from "../../state/spots";
import { colourOf, sensors } from "../../state/store";

export function SensorMap({ progress, grade }: { progress: SensorProgress; grade: Grade }) {
  const cells = cellsOf(progress.covered);
  const extent = extentOf(cells);
  const known = sensors.value.find((s) => s.info?.name === progress.sensor);
  const cone = coneOf(known?.fovHorizontalDeg ?? 0, extent);
  const here = spots.value.get(progress.sensor) ?? [];
  // Ahead is up on the page, so that y runs against it.
  const y = (ahead: number) => extent.ahead - ahead;
  return (
    <svg
      class={`sensor-map grade ${grade}`}
      viewBox={`${-extent.side} -0.1 ${2 * extent.side} ${extent.ahead + 0.4}`}
      role="img"
      aria-label={`${progress.sensor} has seen somebody in ${cells.length} floor cells of half a metre`}
    >
      <polygon class="cone" points={cone.map(([right, ahead]) => `${right},${y(ahead)}`).join(" ")} />
      {cells.map(({ right, ahead }) => (
        <rect key={`${right} ${ahead}`} class="cell" x={right * CELL_M + 0.03} y={y((ahead + 1) * CELL_M) + 0.03} width={CELL_M - 0.06} height={CELL_M - 0.06} />
      ))}
      <rect class={`sensor-fill-${colourOf(progress.sensor)}`} x={-0.25} y={y(0) - 0.06} width={0.5} height={0.18} />
      {here.map(([right, ahead], i) => (
        <circle key={i} class="here" cx={right} cy={y(ahead)} r={0.16} />
      ))}
    </svg>
  );
}
