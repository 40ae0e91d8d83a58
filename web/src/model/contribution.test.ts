import { create } from "@bufbuild/protobuf";
import { describe, expect, it } from "vitest";
import { ContributionSchema } from "../gen/posefuse/v1/room_pb";
import { figure, fill, harm, heatOf, jointParts, median } from "./contribution";

const part = (rejectedShare: number, residualMm?: number) =>
  create(ContributionSchema, { weight: 0.3, rejectedShare, ...(residualMm === undefined ? {} : { residualMm }) });

describe("parts of joints", () => {
  it("are unknown where the server says nothing, sends another shape, or says so", () => {
    expect(jointParts(undefined)).toEqual(new Array(25).fill({ weight: null, rejected: null, residual: null }));
    const residuals = new Array<number>(25).fill(40);
    residuals[3] = -1;
    const parts = jointParts(create(ContributionSchema, { jointWeights: [0.5], jointResidualsMm: residuals }));
    expect(parts[0]).toEqual({ weight: null, rejected: null, residual: 40 });
    expect(parts[3]!.residual).toBeNull();
  });

  it("become figures, bars and marks", () => {
    expect([figure("weight", 0.254), figure("residual", 31.6), figure("rejected", null)]).toEqual(["25", "32", "–"]);
    expect([fill("residual", 75), fill("residual", 900), fill("weight", 0.3), fill("weight", null)]).toEqual([0.5, 1, 0.3, 0]);
    expect([0, 0.1, 0.25].map((v) => heatOf("rejected", v))).toEqual(["calm", "warm", "hot"]);
    expect([20, 60, 100].map((v) => heatOf("residual", v))).toEqual(["calm", "warm", "hot"]);
    expect([heatOf("weight", 1), heatOf("weight", null)]).toEqual(["calm", "none"]);
  });
});

describe("a sensor that hurts", () => {
  it("is one of which much is ignored, in words", () => {
    expect(harm(part(0.31), [], false)).toBe("31 % contradicts the others and is ignored");
    expect(harm(part(0.1, 30), [25, 30, 28], false)).toBe("");
    expect(harm(undefined, [20], true)).toBe("");
  });

  it("is one far from the others, while the others agree", () => {
    expect(harm(part(0, 90), [30, 34], false)).toBe("90 mm off, others 32 mm");
    expect(harm(part(0, 90), [80, 85], false)).toBe("");
    expect(harm(part(0, 50), [10, 12], false)).toBe("");
    expect(harm(part(0, 500), [], false)).toBe("");
  });

  it("does not flicker at a limit", () => {
    expect(harm(part(0.2), [], false)).toBe("");
    expect(harm(part(0.2), [], true)).not.toBe("");
    expect(harm(part(0.17), [], true)).toBe("");
    expect(harm(part(0, 70), [30], false)).toBe("");
    expect(harm(part(0, 70), [30], true)).not.toBe("");
  });
});

describe("median", () => {
  it("is the middle, or between the two in the middle", () => {
    expect([median([]), median([3]), median([9, 1, 5]), median([4, 1, 2, 3])]).toEqual([null, 3, 5, 2.5]);
  });
});
