// What came out of a walk, and what to do with it: accept, repeat, or keep the old one.

import { useEffect, useRef } from "preact/hooks";
import { Verdict, type CalibrateResult } from "../../gen/posefuse/v1/room_pb";
import { sentence } from "../../model/coverage";
import { canAccept, verdictWords } from "../../model/verdict";
import { accept, closeCalibrate, repeatCalibrate } from "../../state/calibrate";
import { sensorNames, status, type Decision } from "../../state/store";
import { Details } from "./Details";

export function Result({ result, decision }: { result: CalibrateResult; decision: Decision }) {
  const offered = canAccept(result) && decision.kind !== "accepted";
  const old = status.value?.calibration !== undefined;
  // What is advised comes first for the keyboard, too: a weak result is better walked again.
  const advised = useRef<HTMLButtonElement>(null);
  const repeats = decision.kind !== "accepted" && result.verdict !== Verdict.PASSED;
  useEffect(() => advised.current?.focus(), [decision.kind === "accepted"]);
  return (
    <div class="panel-body result" data-testid="calibrate-result" data-verdict={verdictWords(result.verdict).word.toLowerCase()} data-decision={decision.kind}>
      <VerdictWord result={result} inForce={decision.kind === "accepted"} />
      {decision.kind === "open" && decision.trouble && (
        <p class="card-trouble bad" role="alert" data-testid="calibrate-trouble">
          {decision.trouble}
        </p>
      )}
      <div class="row decide">
        {offered && (
          <button type="button" ref={repeats ? null : advised} class={repeats ? "large" : "primary large"} disabled={decision.kind === "busy"} data-testid="calibrate-accept" onClick={() => void accept()}>
            Accept
          </button>
        )}
        {decision.kind === "accepted" && (
          <button type="button" ref={advised} class="primary large" data-testid="calibrate-done" onClick={closeCalibrate}>
            Done
          </button>
        )}
        <button type="button" ref={repeats ? advised : null} class={repeats ? "primary large" : "large"} data-testid="calibrate-repeat" onClick={repeatCalibrate}>
          Repeat
        </button>
        {decision.kind !== "accepted" && (
          <button type="button" class="large" data-testid="calibrate-keep" onClick={closeCalibrate}>
            {old ? "Keep the old one" : "Discard"}
          </button>
        )}
      </div>
      <Details result={result} />
    </div>
  );
}

/** The verdict and its reasons; also that of a single sensor's recalibration. */
export function VerdictWord({ result, inForce }: { result: CalibrateResult; inForce: boolean }) {
  const { word, icon, kind, meaning } = verdictWords(result.verdict);
  return (
    <>
      <p class={`verdict ${kind}`} role="status">
        <span class="verdict-icon" aria-hidden="true">{icon}</span> {word}
        <span class="verdict-force">{inForce ? "in force now" : result.calibration ? "not in force yet" : "nothing has changed"}</span>
      </p>
      <p class="meaning">{meaning}</p>
      {result.reasons.length > 0 && (
        <ul class="reasons">
          {result.reasons.map((reason) => (
            <li key={reason}>{sentence(reason, sensorNames.value)}</li>
          ))}
        </ul>
      )}
    </>
  );
}
