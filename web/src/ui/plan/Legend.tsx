// What the colours of the floor mean while a plan is shown, with the share of each.

import { classShares, LAYER_WORDS, layerOf } from "../../model/plan";
import { plan, planLayer } from "../../state/plan";

const WORDS = ["none", "one", "two", "three or more"];

export function PlanLegend() {
  const layer = plan.value && layerOf(plan.value, planLayer.value);
  const shares = layer ? classShares(layer) : null;
  return (
    <ul class="plan-legend" aria-label={`Sensors that see each place, ${LAYER_WORDS[planLayer.value]}`} data-testid="plan-legend">
      <li class="plan-legend-title">Seen by</li>
      {WORDS.map((word, i) => (
        <li key={word}>
          <span class={`swatch cover-${i}`} aria-hidden="true" /> {word} <span class="tabular muted">{shares ? `${Math.round(100 * shares[i]!)} %` : "–"}</span>
        </li>
      ))}
    </ul>
  );
}
