import { create } from "@bufbuild/protobuf";
import { expect, it } from "vitest";
import { RepairStatusSchema } from "../gen/posefuse/v1/room_pb";
import { repairLine } from "./repair";

const line = (init: Parameters<typeof create<typeof RepairStatusSchema>>[1]) => repairLine(create(RepairStatusSchema, init));

it("tells the model, what runs it, how long it takes and what was late", () => {
  const plain = { model: "gru", runtime: "rten 0.27", answers: 9n, p50Ms: 0.82, p99Ms: 2 };
  expect(line(plain)).toEqual({ text: "gru on rten 0.27, 0.8\u00a0ms, 0 late", alert: false });
  expect(line({ ...plain, p50Ms: undefined })?.text).toBe("gru on rten 0.27, 0 late");
  expect(line({ ...plain, late: 3n, failed: 2n })).toEqual({ text: "gru on rten 0.27, 0.8\u00a0ms, 3 late, 2 failed", alert: true });
});

it("tells the name alone of a model of the engine, and nothing where nothing is made up", () => {
  expect(line({ model: "gaussian" })).toEqual({ text: "gaussian", alert: false });
  expect(line({ model: "gaussian", trouble: "no such file" })?.alert).toBe(true);
  expect(line({ model: "none" })).toBeUndefined();
  expect(repairLine(undefined)).toBeUndefined();
});
