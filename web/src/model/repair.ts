// What fills in joints that no sensor sees, in one line.

import type { RepairStatus } from "../gen/posefuse/v1/room_pb";
import { count, fixed } from "./format";

export interface RepairLine {
  text: string;
  /** Something did not come in time or at all. */
  alert: boolean;
}

/** `gru on rten 0.27, 0.8 ms, 0 late`; a model of the engine itself has no counts. `undefined`: nothing is made up. */
export function repairLine(repair: RepairStatus | undefined): RepairLine | undefined {
  if (!repair || repair.model === "" || repair.model === "none") return undefined;
  if (repair.runtime === "") return { text: repair.model, alert: repair.trouble !== "" };
  const parts = [`${repair.model} on ${repair.runtime}`];
  if (repair.p50Ms !== undefined) parts.push(fixed(repair.p50Ms, 1, "ms"));
  parts.push(`${count(repair.late)} late`);
  if (repair.failed > 0n) parts.push(`${count(repair.failed)} failed`);
  return { text: parts.join(", "), alert: repair.late > 0n || repair.failed > 0n };
}
