// Planned sensors as lines to edit: model, place and what they look at. Metres, room axes.

import type { PlannedRow } from "../../model/plan";
import { addByHand, changeRow, MAX_PLANNED, planRows, removeRow } from "../../state/plan";
import { ModelChoice } from "./Panel";

export function Rows() {
  return (
    <>
      <ul class="plan-rows">
        {planRows.value.map((row) => (
          <Row key={row.name} row={row} />
        ))}
      </ul>
      <div class="row">
        <button type="button" onClick={addByHand} disabled={planRows.value.length >= MAX_PLANNED} data-testid="plan-by-hand">
          Add by hand
        </button>
        {planRows.value.length > 0 && (
          <button type="button" onClick={() => (planRows.value = [])} data-testid="plan-clear">
            Remove all planned
          </button>
        )}
      </div>
    </>
  );
}

function Row({ row }: { row: PlannedRow }) {
  return (
    <li data-testid="plan-row" data-sensor={row.name}>
      <div class="row">
        <strong>{row.name}</strong>
        <ModelChoice label={`Model of ${row.name}`} value={row.model} onChange={(model) => changeRow(row.name, { model })} />
        <button type="button" class="small" aria-label={`Remove ${row.name}`} onClick={() => removeRow(row.name)}>
          Remove
        </button>
      </div>
      <Place words="at" row={row} field="at" />
      <Place words="looks at" row={row} field="to" />
    </li>
  );
}

const AXES = ["x", "y", "height"] as const;

function Place({ words, row, field }: { words: string; row: PlannedRow; field: "at" | "to" }) {
  const set = (axis: number, value: number) => {
    if (!Number.isFinite(value)) return;
    const place = row[field].map((v, i) => (i === axis ? value : v)) as PlannedRow["at"];
    changeRow(row.name, { [field]: place });
  };
  return (
    <div class="plan-place" role="group" aria-label={`${row.name} ${words}`}>
      <span>{words}</span>
      {AXES.map((axis, i) => (
        <label key={axis}>
          {axis === "height" ? "z" : axis}
          <input type="number" step={0.1} value={row[field][i]} aria-label={`${row.name} ${words} ${axis}, metres`} onChange={(e) => set(i, e.currentTarget.valueAsNumber)} />
        </label>
      ))}
    </div>
  );
}
