import { create } from "@bufbuild/protobuf";
import { describe, expect, it } from "vitest";
import { CalibrateResultSchema, SensorMoveSchema, SensorState, SensorStatusSchema, StoredCalibrationSchema, Verdict } from "../gen/posefuse/v1/room_pb";
import { FORMATS, inForceName, LARGEST_FILE, moveRow, refuseFile, sensorNames } from "./calibrations";
import { alarmsOf, explainDrift } from "./drift";
import { FIGURE, FIGURE_JOINTS, jointLabel } from "./figure";
import { JOINT_NAMES } from "./joints";
import { canAccept, storedVerdict, verdictWords } from "./verdict";

const plain = (text: string) => text.replaceAll("\u00a0", " ");

describe("drift", () => {
  const moved = { movedMm: 22.6, movedDeg: 1.13, movedSigmaMm: 4, movedSigmaDeg: 0.2, residualMm: 41, usualMm: 24 };
  const sensor = (name: string, alarm: boolean, trouble = "", muted = false) =>
    create(SensorStatusSchema, { info: { name }, state: SensorState.LIVE, trouble, muted, drift: { ...moved, alarm } });
  const what = (trouble: string) => plain(alarmsOf([sensor("right", true, trouble)])[0]!.what);

  it("alarms name the sensor and the amount, and only sensors that moved", () => {
    const alarms = alarmsOf([sensor("left", false), sensor("right", true, "", true), create(SensorStatusSchema, { info: { name: "new" } })]);
    expect(alarms.map(({ sensor: name, muted }) => [name, muted])).toEqual([["right", true]]);
    expect(what("")).toBe("Sensor right has moved by about 23 mm and 1.1°");
  });

  it("alarms use the server's words, which know when two sensors cannot tell which", () => {
    expect(what("sensor right has moved by about 2 cm: walk about")).toBe("Sensor right has moved by about 2 cm");
    expect(what("no frame for 3 s: check its agent")).toBe("Sensor right has moved by about 23 mm and 1.1°");
    const [unsure] = alarmsOf([sensor("right", true, "either sensor right or sensor left has moved by about 2 cm (two sensors cannot tell which): find out")]);
    expect(unsure!.what).toMatch(/^Either sensor right or sensor left has moved/);
    expect(unsure!.remedy).toMatch(/^Find out which/);
  });

  it("is told with its uncertainty, and not where nothing is known", () => {
    expect(plain(explainDrift(sensor("a", true).drift))).toBe(
      "Since it was calibrated it seems to have moved by 23 ± 4 mm and 1.1 ± 0.2°; residual 41 mm, usually 24 mm",
    );
    expect(explainDrift(undefined)).toMatch(/^Nothing can be said/);
  });
});

describe("verdicts", () => {
  it("each have their own word and sign", () => {
    const all = [Verdict.PASSED, Verdict.WEAK, Verdict.FAILED, Verdict.UNSPECIFIED].map(verdictWords);
    expect(new Set(all.map((v) => v.word)).size).toBe(4);
    expect(new Set(all.map((v) => v.icon)).size).toBe(4);
    expect(verdictWords(17 as Verdict).word).toBe("No verdict");
    expect([storedVerdict("weak").word, storedVerdict("").word]).toEqual(["Weak", "Not judged"]);
  });

  it("can be accepted unless they failed or are in force", () => {
    const result = (verdict: Verdict, inForce = false, solved = true) =>
      create(CalibrateResultSchema, { verdict, inForce, ...(solved ? { calibration: {} } : {}) });
    expect(canAccept(result(Verdict.PASSED))).toBe(true);
    expect(canAccept(result(Verdict.WEAK))).toBe(true);
    expect(canAccept(result(Verdict.FAILED))).toBe(false);
    expect(canAccept(result(Verdict.PASSED, true))).toBe(false);
    expect(canAccept(result(Verdict.PASSED, false, false))).toBe(false);
  });
});

describe("kept calibrations", () => {
  it("tell how far a sensor moved, or why that is not known", () => {
    expect(moveRow(create(SensorMoveSchema, { sensor: "a", movedMm: 12.34, movedDeg: 0.456, movedMs: -0.31 }))).toEqual({ mm: "12.3", deg: "0.46", ms: "−0.3", note: "" });
    expect(moveRow(create(SensorMoveSchema, { sensor: "b", missingIn: "after" }))).toEqual({ mm: "–", deg: "–", ms: "–", note: "not in the one in force" });
    expect(moveRow(create(SensorMoveSchema, { sensor: "b", missingIn: "before" })).note).toBe("not in this one");
  });

  it("know which of them is in force, and their sensors in order", () => {
    const stored = (name: string, inForce: boolean) => create(StoredCalibrationSchema, { name, inForce });
    expect(inForceName([stored("a", false), stored("b", true)])).toBe("b");
    expect(inForceName([stored("a", false)])).toBe("");
    const sensors = ["cam10", "cam2"].map((sensor) => ({ sensor }));
    expect(sensorNames(create(StoredCalibrationSchema, { calibration: { sensors } }))).toEqual(["cam2", "cam10"]);
  });

  it("are saved in four forms, and files that cannot be one are refused", () => {
    expect(new Set(FORMATS.map((f) => f.format)).size).toBe(4);
    expect(refuseFile({ name: "room.toml", size: 3000 })).toBe("");
    expect(refuseFile({ name: "room.toml", size: 0 })).toContain("empty");
    expect(refuseFile({ name: "take.mcap", size: LARGEST_FILE * 3 })).toContain("12 MB");
  });
});

describe("the figure of a person", () => {
  it("has every joint once, inside the picture, the person's right on its left", () => {
    expect(FIGURE_JOINTS).toHaveLength(25);
    expect(new Set(FIGURE_JOINTS.map((at) => at.join())).size).toBe(25);
    expect(FIGURE_JOINTS.every(([x, y]) => x > 8 && x < FIGURE.width - 8 && y > 8 && y < FIGURE.height - 5)).toBe(true);
    const at = (name: (typeof JOINT_NAMES)[number]) => FIGURE_JOINTS[JOINT_NAMES.indexOf(name)]!;
    expect(at("HandRight")[0]).toBeLessThan(at("HandLeft")[0]);
  });

  it("names joints as people do", () => {
    expect([jointLabel("HandTipLeft"), jointLabel("KneeRight"), jointLabel("SpineBase"), jointLabel("Head")]).toEqual(["L hand tip", "R knee", "Spine base", "Head"]);
  });
});
