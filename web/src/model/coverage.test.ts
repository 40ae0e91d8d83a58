import { create } from "@bufbuild/protobuf";
import { describe, expect, it } from "vitest";
import { SensorProgressSchema } from "../gen/posefuse/v1/room_pb";
import { cellsOf, coneOf, extentOf, gradeOf, instruction, linkOf } from "./coverage";

describe("covered cells", () => {
  it("are pairs, each once, without a half at the end", () => {
    expect(cellsOf([-1, 4, 0, 4, -1, 4, 7])).toEqual([{ right: -1, ahead: 4 }, { right: 0, ahead: 4 }]);
  });

  it("fit into the map, which grows by whole metres and no further than a room", () => {
    const usual = extentOf([]);
    expect(extentOf([{ right: -6, ahead: 7 }, { right: 5, ahead: 8 }])).toEqual(usual);
    expect(extentOf([{ right: -7, ahead: 10 }])).toEqual({ ahead: 6, side: 4 });
    expect(extentOf([{ right: 6, ahead: 0 }])).toEqual({ ahead: usual.ahead, side: 4 });
    expect(extentOf([{ right: 900, ahead: 900 }])).toEqual({ ahead: 12, side: 12 });
  });
});

describe("a sensor's view from above", () => {
  it("opens by its angle", () => {
    const [apex, left, right] = coneOf(60, { ahead: 5, side: 3 });
    expect(apex).toEqual([0, 0]);
    expect(left![0]).toBeCloseTo(-5 * Math.tan(Math.PI / 6), 9);
    expect(right).toEqual([-left![0], 5]);
  });

  it("is cut off at the map's edges, and absent where the angle is unknown", () => {
    const wide = coneOf(120, { ahead: 5, side: 3 });
    expect(wide).toHaveLength(5);
    expect(wide.every(([x, y]) => Math.abs(x) <= 3 && y <= 5)).toBe(true);
    expect(coneOf(0, { ahead: 5, side: 3 })).toEqual([]);
    expect(coneOf(NaN, { ahead: 5, side: 3 })).toEqual([]);
  });
});

describe("a walk's progress", () => {
  it("is graded by share", () => {
    expect([0, 0.49, 0.5, 0.999, 1].map(gradeOf)).toEqual(["few", "few", "fair", "fair", "enough"]);
  });

  it("names the partner with most shared frames, and none where nothing is shared", () => {
    expect(linkOf(create(SensorProgressSchema, { shared: { b: 30n, c: 90n } }))).toEqual({ partner: "c", frames: 90 });
    expect(linkOf(create(SensorProgressSchema, { shared: { b: 0n } }))).toBeNull();
  });

  it("always tells the person in the room what to do", () => {
    const at = (share: number, hint = "", solving = false) => instruction({ share, hint, solving });
    expect(instruction(null)).toBe("Waiting for the first frames …");
    expect(at(0.2, "walk to where cam1 sees you")).toBe("Walk to where cam1 sees you");
    expect(instruction({ share: 0.2, hint: "`cam1` sees nobody", solving: false }, ["cam1"])).toBe("cam1 sees nobody");
    expect(at(0.2)).toBe("Walk about, turn around, reach.");
    expect(at(1)).toBe("Enough seen.");
    expect(at(1, "stale words", true)).toBe("Thank you. Solving …");
  });
});
