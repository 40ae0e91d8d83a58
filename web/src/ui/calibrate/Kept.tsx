// The calibrations that are kept: which is in force, how far another one differs from it, and the ways back to it, out
// to a file and in from one.

import { plural, ago, madeFrom, dateTime } from "../../model/format";
import type { StoredCalibration } from "../../gen/posefuse/v1/room_pb";
import { FORMATS, inForceName, moveRow, sensorNames } from "../../model/calibrations";
import { storedVerdict } from "../../model/verdict";
import { compare, comparison, download, kept, keptBusy, keptTrouble, restore, type Comparison } from "../../state/calibrations";
import { useNow } from "../Banners";
import { Modal } from "../Modal";
import { ImportFile } from "./ImportFile";

export function CalibrationsDialog() {
  return (
    <Modal name="calibrations" title="Calibrations" wide>
      <KeptList />
      <ImportFile />
    </Modal>
  );
}

function KeptList() {
  const now = useNow(10_000);
  const list = kept.value;
  const inForce = inForceName(list ?? []);
  return (
    <>
      {keptTrouble.value && (
        <p class="card-trouble bad" role="alert" data-testid="kept-trouble">
          {keptTrouble.value}
        </p>
      )}
      {list === null && !keptTrouble.value && <p class="muted">Asking the server …</p>}
      {list?.length === 0 && <p class="muted">None is kept yet: every calibration that comes into force will be.</p>}
      <ul class="kept-list" data-testid="kept-list">
        {(list ?? []).map((stored) => (
          <Kept key={stored.name} stored={stored} inForce={inForce} now={now} />
        ))}
      </ul>
    </>
  );
}

function Kept({ stored, inForce, now }: { stored: StoredCalibration; inForce: string; now: number }) {
  const { name, calibration } = stored;
  const verdict = storedVerdict(calibration?.verdict ?? "");
  const names = sensorNames(stored);
  const compared = comparison.value?.name === name ? comparison.value : null;
  const busy = keptBusy.value !== "";
  return (
    <li class={stored.inForce ? "kept shown" : "kept"} data-testid="kept" data-name={name} data-in-force={stored.inForce}>
      <div class="kept-head">
        <h3 title={name}>{calibration?.created ? dateTime(calibration.created) : name}</h3>
        {calibration && (
          <span class={`state ${verdict.kind}`}>
            <span aria-hidden="true">{verdict.icon}</span> {verdict.word}
          </span>
        )}
        {stored.inForce && <span class="badge info">In force</span>}
      </div>
      {calibration && (
        <p class="kept-facts muted">
          {calibration.created && <span>{ago(Date.parse(calibration.created), now)}</span>}
          <span>{madeFrom(calibration.method, calibration.floor)}</span>
          <span>
            {plural(names.length, "sensor")}: {names.join(", ")}
          </span>
        </p>
      )}
      {stored.trouble && <p class="card-trouble bad">{stored.trouble}</p>}
      {calibration && (
        <div class="row kept-actions">
          {!stored.inForce && (
            <>
              <button type="button" disabled={busy} data-testid="kept-restore" aria-label={`Put ${name} in force`} onClick={() => void restore(name)}>
                Put in force
              </button>
              <button
                type="button" disabled={busy || !inForce} aria-expanded={compared !== null} data-testid="kept-compare"
                aria-label={`Compare ${name} with the one in force`} onClick={() => void compare(name)}
              >
                Compare
              </button>
            </>
          )}
          <span class="save" role="group" aria-label={`Save ${name} as`}>
            <span class="muted">Save as</span>
            {FORMATS.map(({ format, label, title }) => (
              <button key={format} type="button" class="quiet" disabled={busy} title={title} data-testid={`kept-save-${format}`} onClick={() => void download(name, format)}>
                {label}
              </button>
            ))}
          </span>
        </div>
      )}
      {compared && <Moves comparison={compared} />}
    </li>
  );
}

function Moves({ comparison: { moves } }: { comparison: Comparison }) {
  if (moves.length === 0) return <p class="muted">The two have no sensor in common.</p>;
  return (
    <table class="figures-table moves" data-testid="moves">
      <caption>How far each sensor stands from where the one in force has it, both rooms laid over each other</caption>
      <thead>
        <tr>
          <th scope="col">Sensor</th>
          <th scope="col" class="num">Moved mm</th>
          <th scope="col" class="num">Turned °</th>
          <th scope="col" class="num">Time ms</th>
          <th scope="col" />
        </tr>
      </thead>
      <tbody>
        {moves.map((move) => {
          const row = moveRow(move);
          return (
            <tr key={move.sensor}>
              <th scope="row">{move.sensor}</th>
              <td class="num">{row.mm}</td>
              <td class="num">{row.deg}</td>
              <td class="num">{row.ms}</td>
              <td class="muted">{row.note}</td>
            </tr>
          );
        })}
      </tbody>
    </table>
  );
}
