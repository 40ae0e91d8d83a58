import { describe, expect, it } from "vitest";
import { agentLines, ago, bytes, count, dateTime, duration, exportLine, fixed, madeFrom, nextTakeName, offset, plural } from "./format";

/** Unbreakable spaces as plain ones, to keep the expectations readable. */
const plain = (text: string) => text.replaceAll(/[\u202f\u00a0]/g, " ");

describe("figures", () => {
  it("have fixed digits, a true minus, and a dash for what is not known", () => {
    expect(plain(fixed(29.96, 1, "fps"))).toBe("30.0 fps");
    expect(fixed(-3.2, 1)).toBe("−3.2");
    expect(fixed(-0.01, 1)).toBe("0.0");
    expect(fixed(undefined, 1, "ms")).toBe("–");
    expect(fixed(NaN, 1)).toBe("–");
  });

  it("tell a clock's offset with its bound", () => {
    expect(plain(offset(1.24, 0.31))).toBe("+1.2 ± 0.3 ms");
    expect(plain(offset(-3_600_000, 0.4))).toBe("−3600.000 s ± 0.4 ms");
    expect(offset(undefined, 1)).toBe("–");
  });

  it("tell durations", () => {
    expect(duration(7.38, true)).toBe("0:07.3");
    expect(duration(59.99, true)).toBe("0:59.9");
    expect(duration(3723)).toBe("1:02:03");
    expect(duration(NaN)).toBe("–");
  });

  it("tell sizes and counts", () => {
    expect(plain(bytes(999n))).toBe("999 B");
    expect(plain(bytes(1_240_000n))).toBe("1.2 MB");
    expect(plain(bytes(112_000_000_000n))).toBe("112 GB");
    expect(plain(count(1234567n))).toBe("1 234 567");
    expect(plural(1, "person", "people")).toBe("1 person");
    expect(plural(0, "person", "people")).toBe("0 people");
  });

  it("tell how long ago", () => {
    expect([5, 60, 600, 7200, 200_000].map((s) => ago(0, s * 1000))).toEqual(["just now", "60 s ago", "10 min ago", "2 h ago", "2 days ago"]);
    expect(ago(NaN, 0)).toBe("at an unknown time");
  });

  it("keep a date that cannot be read", () => {
    expect(dateTime("2031-02-03T04:05:06Z")).toMatch(/^2031-02-0[234] \d\d:\d\d$/);
    expect(dateTime("soon")).toBe("soon");
  });
});

describe("names", () => {
  it("count up, keeping their width", () => {
    expect(nextTakeName("walk_009")).toBe("walk_010");
    expect(nextTakeName("walk99")).toBe("walk100");
    expect(nextTakeName("walk")).toBe("walk");
    expect(nextTakeName("")).toBe("");
  });

  it("of the server go into the agents' lines", () => {
    const lines = agentLines("http://127.0.0.1:1234").split("\n");
    expect(lines.map((line) => line.replace("--sensor 1", "--sensor 2"))).toEqual(new Array(2).fill("posefuse agent sim --sensor 2 --server http://127.0.0.1:1234 &"));
    expect(lines[0]).toContain("--sensor 1");
  });

  it("write a take's files, wherever takes are", () => {
    expect(exportLine("walk-1", "unity", "/home/ada/takes")).toBe("posefuse export walk-1 --preset unity --takes /home/ada/takes");
    expect(exportLine("walk-1", "blender", "/my takes")).toBe('posefuse export walk-1 --preset blender --takes "/my takes"');
    expect(exportLine("walk-1", "blender", "")).toBe("posefuse export walk-1 --preset blender");
  });

  it("of methods become plain words", () => {
    expect(madeFrom("svd", "walk")).toBe("from a walk, floor found from the walk");
    expect(madeFrom("truth", "manual")).toBe("as simulated, floor set by hand");
    expect(madeFrom("", "assumed")).toBe("from an unnamed source, floor assumed");
    expect(madeFrom("charuco", "")).toBe("method charuco");
  });
});
