import { create } from "@bufbuild/protobuf";
import { describe, expect, it } from "vitest";
import { PlanLayerSchema, PlanSensorSchema, RoomPlanSchema } from "../gen/posefuse/v1/room_pb";
import { areaSeen, classShares, marksOf, pairOf, readRows, rowOf, unusedName } from "./plan";

const layer = create(PlanLayerSchema, { counts: Uint8Array.from([0, 1, 2, 2, 5, 9, 3, 1]) });
// Looks along the room's x: right is -y, down is -z.
const level = { translation: { x: 1, y: 2, z: 1.2 }, rotation: { x: 0.5, y: -0.5, z: 0.5, w: -0.5 } };

describe("plans of the room", () => {
  it("count each cell in one class", () => {
    const shares = classShares(layer);
    expect(shares).toEqual([1 / 8, 2 / 8, 2 / 8, 3 / 8]);
    expect(shares.reduce((a, b) => a + b)).toBeCloseTo(1);
    expect(areaSeen(create(RoomPlanSchema, { cellM: 0.5 }), layer, 2)).toBeCloseTo(5 * 0.25);
  });

  it("make a placed sensor one to edit", () => {
    const row = rowOf(create(PlanSensorSchema, { name: "a", model: "Xtion", roomFromSensor: level }))!;
    expect(row.at).toEqual([1, 2, 1.2]);
    expect(row.to).toEqual([3.5, 2, 1.2]);
    // 30 degrees down from 1.9 m meets 0.9 m two metres on.
    const half = (-30 * Math.PI) / 360;
    const [c, s] = [Math.cos(half), Math.sin(half)];
    const tilted = { translation: { x: 0, y: 0, z: 1.9 }, rotation: { x: 0.5 * c - 0.5 * s, y: 0.5 * s - 0.5 * c, z: 0.5 * c + 0.5 * s, w: -0.5 * c - 0.5 * s } };
    const down = rowOf(create(PlanSensorSchema, { name: "b", roomFromSensor: tilted }))!;
    expect(down.to[0]).toBeCloseTo(1 / Math.tan(Math.PI / 6), 1);
    expect(down.to[2]).toBeCloseTo(0.9, 1);
    expect(rowOf(create(PlanSensorSchema, { name: "c" }))).toBeNull();
  });

  it("draw sensors that are there, planned and next", () => {
    const sensor = (name: string, planned: boolean) => ({ name, planned, roomFromSensor: level, fovHorizontalDeg: 60, fovVerticalDeg: 45, nearM: 0.5, farM: 4 });
    const plan = create(RoomPlanSchema, { sensors: [sensor("a", false), sensor("b", true), { name: "nowhere" }], suggestion: { sensor: sensor("c", true) } });
    expect(marksOf(plan).map((m) => [m.name, m.kind])).toEqual([["a", "there"], ["b", "planned"], ["c", "next"]]);
  });

  it("tell the larger share of a pair", () => {
    const pair = pairOf({ a: "a", b: "b", severity: "strong", facing: false, shareOfA: 0.1, shareOfB: 0.4, advice: "x" } as never);
    expect(pair).toMatchObject({ strong: true, share: 0.4 });
  });

  it("trust nothing that the browser kept", () => {
    const good = { name: "plan-1", model: "Xtion", at: [0, 0, 1], to: [1, 0, 1] };
    expect(readRows(JSON.stringify([good, { ...good, at: [0, "1", 1] }, null, 7]))).toEqual([good]);
    expect(readRows("{")).toEqual([]);
    expect(readRows(null)).toEqual([]);
    expect(readRows('{"a":1}')).toEqual([]);
  });

  it("find a free name", () => {
    expect(unusedName(["plan-1", "plan-3"])).toBe("plan-2");
  });
});
