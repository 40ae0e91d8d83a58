// While somebody walks: the hint in letters read across the room, how far it is, and each sensor's view from above.

import type { CalibrateProgress, SensorProgress } from "../../gen/posefuse/v1/room_pb";
import { gradeOf, GRADE_WORDS, instruction, linkOf } from "../../model/coverage";
import { count, duration } from "../../model/format";
import { untilEnough } from "../../state/calibrate";
import { sensorNames } from "../../state/store";
import { Bar } from "../Bar";
import { SensorMap } from "./SensorMap";

/** So many letters fill two lines; longer hints are set smaller, in the same space. */
const LONG_HINT = 52;

export function Walking({ progress }: { progress: CalibrateProgress | null }) {
  const share = progress?.solving ? 1 : Math.min(progress?.share ?? 0, 1);
  const left = progress ? Math.max(progress.totalSeconds - progress.elapsedSeconds, 0) : 0;
  const grade = gradeOf(share);
  const words = instruction(progress, sensorNames.value);
  const end = !progress || progress.solving ? "" : untilEnough.value ? `ends by itself, in ${duration(left)} at the latest` : `${duration(left)} left`;
  return (
    <div class="walking" data-testid="calibrate-walking" data-solving={progress?.solving ?? false}>
      <p class={words.length > LONG_HINT ? "hint long" : "hint"} role="status" data-testid="calibrate-hint">
        {words}
      </p>
      <div class="progress">
        <span class={`percent grade ${grade}`} data-testid="calibrate-share">
          {Math.floor(100 * share)}&nbsp;%
        </span>
        <div class="progress-bar">
          <Bar share={share} kind={`grade ${grade}`} label="Share of what is needed that has been seen" testid="calibrate-progress" />
          <p class="times tabular">
            <span>{progress ? `${duration(progress.elapsedSeconds)} walked` : " "}</span>
            <span>{end}</span>
          </p>
        </div>
      </div>
      <ul class="maps">
        {inOrder(progress?.sensors ?? []).map((s) => {
          const of = gradeOf(s.share);
          const link = linkOf(s);
          return (
            <li key={s.sensor} class="map" data-testid="calibrate-sensor" data-sensor={s.sensor} data-cells={s.covered.length / 2}>
              <h3 title={s.sensor}>{s.sensor}</h3>
              <SensorMap progress={s} grade={of} />
              <Bar share={s.share} kind={`grade ${of}`} label={`${s.sensor}: share of what it needs`} />
              <p class="map-words">
                <span class={`grade ${of}`}>
                  {Math.floor(100 * Math.min(s.share, 1))}&nbsp;% {GRADE_WORDS[of]}
                  {of === "enough" && <span aria-hidden="true"> ✓</span>}
                </span>
                <span class="muted tabular" title="Frames in which both saw somebody">{link ? `${count(link.frames)} shared with ${link.partner}` : "shared with none"}</span>
              </p>
            </li>
          );
        })}
      </ul>
    </div>
  );
}

/** As on the cards. */
function inOrder(list: readonly SensorProgress[]): SensorProgress[] {
  return [...list].sort((a, b) => a.sensor.localeCompare(b.sensor, "en", { numeric: true }));
}
