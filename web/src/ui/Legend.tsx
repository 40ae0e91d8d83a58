// What the marks in the 3D view mean. Shape says what colour says.

import { colourOf, show, shownSensors } from "../state/store";

export function Legend() {
  return (
    <ul class="legend" aria-label="Legend" data-testid="legend">
      <li>
        <svg viewBox="0 0 12 12" class="fill-measured" aria-hidden="true"><circle cx="6" cy="6" r="4.5" /></svg> measured
      </li>
      <li>
        <svg viewBox="0 0 12 12" class="fill-inferred" aria-hidden="true"><rect x="2" y="2" width="8" height="8" /></svg> inferred
      </li>
      <li>
        <svg viewBox="0 0 12 12" class="fill-repaired" aria-hidden="true"><path d="M6 .8 11.2 6 6 11.2.8 6z" /></svg> repaired
      </li>
      {show.halos.value && (
        <li>
          <svg viewBox="0 0 12 12" class="halo" aria-hidden="true"><circle cx="6" cy="6" r="5" /><circle cx="6" cy="6" r="1.6" /></svg> halo: 2 σ
        </li>
      )}
      {show.raw.value &&
        shownSensors.value.map((s) => (
          <li key={s.info?.name}>
            <span class={`dash sensor-colour-${colourOf(s.info?.name ?? "")}`} aria-hidden="true" /> {s.info?.name}
          </li>
        ))}
    </ul>
  );
}
