// The figures behind a verdict: every sensor, and every pair of sensors, on frames held back.

import type { CalibrateResult, PairResidual, SensorResult } from "../../gen/posefuse/v1/room_pb";
import { count, fixed } from "../../model/format";

const mm = (m: number | undefined) => fixed(m === undefined ? undefined : m * 1000, 0);
const percent = (share: number) => fixed(100 * share, 0);

export function Details({ result }: { result: CalibrateResult }) {
  if (result.sensors.length === 0 && result.pairs.length === 0) return null;
  return (
    <details class="details" data-testid="calibrate-details">
      <summary>Details</summary>
      <div class="tables">
        {result.sensors.length > 0 && <SensorTable sensors={result.sensors} />}
        {result.pairs.length > 0 && <PairTable pairs={result.pairs} />}
        {result.rayBiasMm !== undefined && (
          <p class="muted">Trackers place joints {fixed(result.rayBiasMm, 0, "mm")} in front of where they are, mean over the joints. Fusing takes that back.</p>
        )}
      </div>
    </details>
  );
}

function SensorTable({ sensors }: { sensors: SensorResult[] }) {
  return (
    <div class="table-scroll" tabIndex={0} role="group" aria-label="Sensors, a table that scrolls">
      <table class="figures-table">
        <caption>Each sensor against the others, on frames held back</caption>
        <thead>
          <tr>
            <th scope="col">Sensor</th>
            <th scope="col" class="num">Median mm</th>
            <th scope="col" class="num">95 % mm</th>
            <th scope="col" class="num" title="One standard deviation of the place: how well it is known">σ mm</th>
            <th scope="col" class="num" title="One standard deviation of the direction">σ °</th>
            <th scope="col" class="num" title="One standard deviation of the time offset">σ ms</th>
            <th scope="col" class="num" title="Added to its capture times">Offset ms</th>
            <th scope="col" class="num" title="How fast its clock runs away from the others'; – where the walk was too short to tell">Clock ppm</th>
            <th scope="col" class="num" title="Its bone lengths over the median of all sensors'">Bones</th>
            <th scope="col" class="num">Samples</th>
          </tr>
        </thead>
        <tbody>
          {sensors.map((s) => (
            <tr key={s.sensor}>
              <th scope="row">{s.sensor}</th>
              <td class="num strong">{mm(s.medianM)}</td>
              <td class="num">{mm(s.p95M)}</td>
              <td class="num">{fixed(s.sigma && s.sigma.positionM * 1000, 1)}</td>
              <td class="num">{fixed(s.sigma?.rotationDeg, 2)}</td>
              <td class="num">{fixed(s.sigma?.timeMs, 1)}</td>
              <td class="num">{fixed(s.timeOffsetMs, 1)}</td>
              <td class="num">{fixed(s.clockDriftPpm, 0)}</td>
              <td class="num">{s.boneScale > 0 ? fixed(s.boneScale, 3) : "–"}</td>
              <td class="num">{count(s.samples)}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function PairTable({ pairs }: { pairs: PairResidual[] }) {
  return (
    <div class="table-scroll" tabIndex={0} role="group" aria-label="Pairs, a table that scrolls">
      <table class="figures-table">
        <caption>How far two sensors' joints lie apart</caption>
        <thead>
          <tr>
            <th scope="col">Pair</th>
            <th scope="col" class="num" title="Both sensors taken to stand in the same place, RMS">Before mm</th>
            <th scope="col" class="num" title="Median under this calibration">After mm</th>
            <th scope="col" class="num">95 % mm</th>
            <th scope="col" class="num" title="Shared frames in which most joints agree">Agreeing %</th>
            <th scope="col" class="num" title="Shared frames in which left and right were exchanged between the two">Mirrored %</th>
            <th scope="col" class="num">Samples</th>
          </tr>
        </thead>
        <tbody>
          {pairs.map((p) => (
            <tr key={`${p.a} ${p.b}`}>
              <th scope="row">
                {p.a} – {p.b}
                {p.weakest && <span class="badge warn weakest" title="This pair holds the room together, and it is the weakest of those that do">weakest link</span>}
              </th>
              <td class="num">{mm(p.beforeRmsM)}</td>
              <td class="num strong">{mm(p.afterMedianM)}</td>
              <td class="num">{mm(p.afterP95M)}</td>
              <td class="num">{percent(p.agreeingShare)}</td>
              <td class="num">{percent(p.mirroredShare)}</td>
              <td class="num">{count(p.samples)}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}
