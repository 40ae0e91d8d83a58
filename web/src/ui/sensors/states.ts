// A sensor's state as word, sign and kind.

import { SensorState } from "../../gen/posefuse/v1/room_pb";

export const STATES: Record<SensorState, { word: string; icon: string; kind: string; name: string }> = {
  [SensorState.LIVE]: { word: "Live", icon: "●", kind: "ok", name: "live" },
  [SensorState.STALLED]: { word: "Stalled", icon: "▲", kind: "warn", name: "stalled" },
  [SensorState.DISCONNECTED]: { word: "Disconnected", icon: "✕", kind: "bad", name: "disconnected" },
  [SensorState.UNSPECIFIED]: { word: "Unknown", icon: "?", kind: "muted", name: "unknown" },
};
