import { describe, expect, it } from "vitest";
import { assignColours, SENSOR_COLOURS, usualColour } from "./colours";

describe("sensor colours", () => {
  it("do not depend on the order in which the sensors joined", () => {
    const names = ["left", "right", "centre", "cam1", "cam2"];
    expect(assignColours([...names].reverse())).toEqual(assignColours(names));
  });

  it("differ until there are more sensors than colours, and stay within range then", () => {
    const names = Array.from({ length: 12 }, (_, i) => `kinect ${i * 7}`);
    expect(new Set(assignColours(names.slice(0, SENSOR_COLOURS)).values()).size).toBe(SENSOR_COLOURS);
    const all = [...assignColours(names).values()];
    expect(all.length).toBe(12);
    expect(all.every((c) => c >= 0 && c < SENSOR_COLOURS)).toBe(true);
  });

  it("stay when somebody joins who has another one", () => {
    const others = ["cam1", "cam2", "cam3", "cam4"];
    expect(new Set(others.map(usualColour)).size).toBe(4);
    expect(assignColours(["cam2"]).get("cam2")).toBe(assignColours(others).get("cam2"));
  });
});
