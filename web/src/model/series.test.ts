import { describe, expect, it } from "vitest";
import { axisTop, Series, SpeedMeter } from "./series";

describe("series", () => {
  it("keeps the last span only", () => {
    const series = new Series(2);
    for (let t = 0; t <= 5; t++) series.push(t, 10 * t);
    expect(series.points.map((p) => p.time)).toEqual([3, 4, 5]);
    expect(series.latest).toEqual({ time: 5, value: 50 });
  });

  it("starts anew when time steps back, and takes no value twice or non-finite", () => {
    const series = new Series(10);
    series.push(5, 1);
    series.push(5, 2);
    series.push(6, NaN);
    expect(series.points).toEqual([{ time: 5, value: 1 }]);
    series.push(1, 3);
    expect(series.points).toEqual([{ time: 1, value: 3 }]);
  });

  it("finds the value near a time", () => {
    const series = new Series(10);
    series.push(1, 1);
    series.push(2, 2);
    expect(series.near(1.8, 0.5)?.value).toBe(2);
    expect(series.near(4, 0.5)).toBeUndefined();
  });
});

describe("speed", () => {
  it("of steady motion is exact", () => {
    const meter = new SpeedMeter();
    let speed: number | null = null;
    for (let i = 0; i < 10; i++) speed = meter.push(i / 30, (3 * i) / 30, 0, (4 * i) / 30);
    expect(speed).toBeCloseTo(5, 9);
  });

  it("of a resting point with jitter is far below a plain difference", () => {
    const meter = new SpeedMeter();
    let largest = 0;
    for (let i = 0; i < 60; i++) largest = Math.max(largest, meter.push(i / 30, i % 2 ? 0.005 : -0.005, 0, 0) ?? 0);
    expect(largest).toBeLessThan(0.3 * 0.25);
  });

  it("waits for three samples, and again after a gap", () => {
    const meter = new SpeedMeter();
    expect(meter.push(0, 0, 0, 0)).toBeNull();
    expect(meter.push(0.03, 0, 0, 0)).toBeNull();
    expect(meter.push(0.06, 0, 0, 0)).toBe(0);
    expect(meter.push(1, 9, 9, 9)).toBeNull();
  });
});

describe("value axis", () => {
  it("ends at a round figure above the largest value", () => {
    expect([axisTop(0, 1), axisTop(1.2, 1), axisTop(2, 1), axisTop(43, 20), axisTop(0.35, 0.1)]).toEqual([1, 1.5, 2, 50, 0.4]);
  });
});
