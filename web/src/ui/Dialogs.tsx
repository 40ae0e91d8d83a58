// Two dialogs: the keyboard shortcuts, and the configuration in force.

import { useEffect, useState } from "preact/hooks";
import { explain, room } from "../net/client";
import { singleKeys } from "../state/prefs";
import { status } from "../state/store";
import { SHORTCUTS } from "./keys";
import { Modal } from "./Modal";

const VIEW_KEYS = [
  ["← → ↑ ↓", "Turn the view"],
  ["Shift + ← → ↑ ↓", "Move the view"],
  ["+ −", "Nearer, further"],
] as const;

export function HelpDialog() {
  return (
    <Modal name="help" title="Keyboard">
      <div class="keys">
        <section>
          <h3>Anywhere</h3>
          <dl>
            {SHORTCUTS.map((s) => (
              <div key={s.key}>
                <dt>
                  <kbd>{s.label}</kbd>
                </dt>
                <dd>{s.text}</dd>
              </div>
            ))}
          </dl>
        </section>
        <section>
          <h3>With the 3D view in focus</h3>
          <dl>
            {VIEW_KEYS.map(([keys, text]) => (
              <div key={keys}>
                <dt>
                  <kbd>{keys}</kbd>
                </dt>
                <dd>{text}</dd>
              </div>
            ))}
          </dl>
          <h3>Mouse</h3>
          <p>Drag to turn, right button to move, wheel to come nearer.</p>
          <label class="check">
            <input type="checkbox" checked={singleKeys.value} onChange={(e) => (singleKeys.value = e.currentTarget.checked)} />
            Single keys are shortcuts
          </label>
        </section>
      </div>
    </Modal>
  );
}

export function ConfigDialog() {
  return (
    <Modal name="config" title="Configuration in force">
      <ConfigText />
    </Modal>
  );
}

function ConfigText() {
  const [text, setText] = useState<{ toml?: string; trouble?: string }>({});
  useEffect(() => {
    room.getConfig({}, { timeoutMs: 10_000 }).then(
      (answer) => setText({ toml: answer.toml }),
      (error: unknown) => setText({ trouble: explain(error) }),
    );
  }, []);
  return (
    <>
      <p class="muted">
        Server {status.value?.serverVersion || "–"}, takes go to <code>{status.value?.takeFolder || "–"}</code>. Change it in{" "}
        <code>~/.config/posefuse/server.toml</code> on its machine, or the file of its <code>--config</code>, and start it anew.
      </p>
      {text.trouble && <p class="card-trouble warn" role="alert">{text.trouble}</p>}
      <p class="muted">
        <a href="./licenses.txt" target="_blank" rel="noreferrer">
          Licences of the software in this page
        </a>
      </p>
      <pre class="config" tabIndex={0} aria-label="Configuration, TOML">{text.toml ?? ""}</pre>
    </>
  );
}
