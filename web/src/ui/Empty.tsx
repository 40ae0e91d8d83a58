// What to do when there is nothing to see.

import { agentLines } from "../model/format";
import { planOpen } from "../state/plan";
import { calibrateBlocked, calibratedSensors, calibrating, canCalibrate, connection, liveSensors, peopleIds, replay, sensors, status } from "../state/store";
import { Command } from "./Command";
import { openCalibrate } from "./keys";

export function Empty() {
  // A room is planned before there is anything in it.
  if (planOpen.value) return null;
  if (!status.value || replay.value || connection.value.kind === "offline") return null;
  if (sensors.value.length === 0) return <NoSensor />;
  if (liveSensors.value === 0) {
    return <p class="view-hint warn-text" data-testid="hint">▲ No sensor delivers. The cards on the left say why.</p>;
  }
  if (calibratedSensors.value === 0 && calibrating.value.kind === "closed") {
    return (
      <div class="view-hint" data-testid="hint">
        The sensors' places are not known yet.{status.value.recording && " Stop the recording to calibrate."}
        <button type="button" class="primary" disabled={!canCalibrate.value} title={calibrateBlocked.value || undefined} onClick={openCalibrate}>
          Calibrate
        </button>
      </div>
    );
  }
  if (peopleIds.value.length === 0) return <p class="view-hint muted" data-testid="hint">Nobody in view.</p>;
  return null;
}

function NoSensor() {
  const lines = agentLines(location.origin);
  const loopback = ["127.0.0.1", "localhost", "[::1]"].includes(location.hostname);
  return (
    <div class="view-message" data-testid="empty">
      <h2>No sensor yet</h2>
      <p>To see this room at work with two simulated sensors, run these lines, then press Calibrate:</p>
      <Command lines={lines} name="empty-command" />
      <p class="muted">
        {loopback
          ? "They work on this machine. On another one, put this server's own address in place of " + location.hostname + "."
          : "Run one agent beside each sensor. It may start before the server."}
      </p>
      <p>
        Where should sensors stand?{" "}
        <button type="button" data-testid="empty-plan" onClick={() => (planOpen.value = true)}>
          Plan the room
        </button>
      </p>
    </div>
  );
}
