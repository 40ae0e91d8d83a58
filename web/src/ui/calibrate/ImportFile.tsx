// A calibration from a file: dropped or chosen, read by the server first, put in force only when somebody says so.

import { useRef, useState } from "preact/hooks";
import { madeFrom, plural } from "../../model/format";
import { acceptImport, imported, readFile } from "../../state/calibrations";

export function ImportFile() {
  const input = useRef<HTMLInputElement>(null);
  const [over, setOver] = useState(false);
  const take = (files: FileList | null | undefined) => {
    const file = files?.[0];
    if (file) void readFile(file);
  };
  const drop = (event: DragEvent) => {
    event.preventDefault();
    setOver(false);
    take(event.dataTransfer?.files);
  };
  return (
    <section
      class={over ? "import over" : "import"}
      aria-label="Calibration from a file"
      data-testid="import"
      onDragOver={(event) => {
        event.preventDefault();
        setOver(true);
      }}
      onDragLeave={() => setOver(false)}
      onDrop={drop}
    >
      <div class="row">
        <button type="button" data-testid="import-choose" onClick={() => input.current?.click()}>
          Read a file …
        </button>
        <span class="muted">or drop one here: TOML, JSON, ROS tf2 or OpenCV. Nothing changes before you say so.</span>
        <input
          ref={input} type="file" class="visually-hidden" tabIndex={-1} aria-hidden="true" accept=".toml,.json,.yaml,.yml,.txt" data-testid="import-file"
          onChange={(event) => {
            take(event.currentTarget.files);
            event.currentTarget.value = "";
          }}
        />
      </div>
      <Read />
    </section>
  );
}

function Read() {
  const chosen = imported.value;
  switch (chosen.kind) {
    case "none":
      return null;
    case "reading":
      return <p role="status">Reading {chosen.file} …</p>;
    case "refused":
      return (
        <div role="alert" class="card-trouble bad" data-testid="import-trouble">
          <strong>{chosen.file}</strong>
          <p class="verbatim">{chosen.trouble}</p>
        </div>
      );
    case "read": {
      const { calibration } = chosen;
      return (
        <div data-testid="import-read">
          <p role="status">
            <strong>{chosen.file}</strong>: {plural(calibration.sensors.length, "sensor")} ({calibration.sensors.map((s) => s.sensor).join(", ")}),{" "}
            {madeFrom(calibration.method, calibration.floor)}.
          </p>
          {chosen.trouble && <p class="card-trouble bad" role="alert">{chosen.trouble}</p>}
          <div class="row">
            <button type="button" class="primary" data-testid="import-accept" onClick={() => void acceptImport()}>
              Put in force
            </button>
            <button type="button" onClick={() => (imported.value = { kind: "none" })}>
              Leave it
            </button>
          </div>
        </div>
      );
    }
  }
}
