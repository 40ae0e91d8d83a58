// Before the walk: what to do, and how long it goes on.

import { useState } from "preact/hooks";
import { plural } from "../../model/format";
import { calibrate, large } from "../../state/calibrate";
import { speaking, voice } from "../../state/speech";
import { liveSensors, sensors } from "../../state/store";

const USUAL_S = 30;
const RANGE_S = { min: 5, max: 300 };

export function Intro() {
  const [fixed, setFixed] = useState(false);
  const [seconds, setSeconds] = useState(USUAL_S);
  const few = liveSensors.value < 2;
  const muted = sensors.value.filter((s) => s.muted).length;
  const start = (event: Event) => {
    event.preventDefault();
    void calibrate(fixed ? seconds : 0);
  };
  return (
    <div class="panel-body">
      <p>Exactly one person is in the room. While it runs:</p>
      <ol class="steps">
        <li>
          <strong>Walk about</strong> the whole floor, not only its middle.
        </li>
        <li>
          <strong>Turn around</strong> now and then, so that each sensor sees your front.
        </li>
        <li>
          <strong>Reach</strong> up and to the sides; crouch once.
        </li>
      </ol>
      <p class="muted">Everybody else waits outside. Nobody touches a sensor. The calibration in force stays until you accept a new one.</p>
      <form class="calibrate-form" onSubmit={start}>
        <fieldset class="choices">
          <legend>It ends</legend>
          <label class="check">
            <input type="radio" name="ends" checked={!fixed} data-testid="calibrate-enough" onChange={() => setFixed(false)} />
            when enough has been seen
          </label>
          <label class="check">
            <input type="radio" name="ends" checked={fixed} data-testid="calibrate-fixed" onChange={() => setFixed(true)} />
            after
            <input
              type="number" min={RANGE_S.min} max={RANGE_S.max} step={1} value={seconds} aria-label="Seconds" data-testid="calibrate-seconds"
              onInput={(e) => {
                setSeconds(Number(e.currentTarget.value));
                setFixed(true);
              }}
            />
            seconds
          </label>
        </fieldset>
        <label class="check">
          <input type="checkbox" checked={large.value} onChange={(e) => (large.value = e.currentTarget.checked)} />
          Fill the window, to be read across the room
        </label>
        {voice.value && (
          <label class="check">
            <input type="checkbox" checked={speaking.value} data-testid="calibrate-speak" onChange={(e) => (speaking.value = e.currentTarget.checked)} />
            Speak the hints
          </label>
        )}
        {few && <p class="warn-text">▲ {liveSensors.value} of {plural(sensors.value.length, "sensor")} live: it takes two to calibrate.</p>}
        {muted > 0 && <p class="muted">{plural(muted, "muted sensor is", "muted sensors are")} calibrated with the others.</p>}
        <button type="submit" class="primary large" data-testid="calibrate-start">
          Start
        </button>
      </form>
    </div>
  );
}
