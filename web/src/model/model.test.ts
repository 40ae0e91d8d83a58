import { create } from "@bufbuild/protobuf";
import { describe, expect, it } from "vitest";
import { ObservationSchema, PoseSchema, Provenance, RoomFrameSchema, TrackSchema } from "../gen/posefuse/v1/types_pb";
import { delayMs } from "./backoff";
import { ellipsoid } from "./covariance";
import { bitsOf, decodeFrame, decodeTrack, worse } from "./frame";
import { BONES, JOINT_COUNT, JOINT_NAMES } from "./joints";
import { placeBodies, rigidOf } from "./raw";

const POSITIONS = Array.from({ length: 75 }, (_, i) => i / 10);
const MEASURED = new Array<Provenance>(25).fill(Provenance.MEASURED);

function track(change: object = {}) {
  return create(TrackSchema, { id: 7n, sensors: 0b101n, positions: POSITIONS, provenances: MEASURED, ...change });
}

describe("joints", () => {
  it("are a tree rooted at the pelvis", () => {
    expect(JOINT_NAMES).toHaveLength(25);
    const children = BONES.map(([, child]) => child);
    expect(new Set(children).size).toBe(24);
    expect(children).not.toContain(0);
    const reached = new Set([0]);
    for (const [parent, child] of BONES) {
      expect(reached.has(parent)).toBe(true);
      reached.add(child);
    }
  });
});

describe("decoding a frame", () => {
  it("takes positions, provenances and contributing sensors", () => {
    const person = decodeTrack(track())!;
    expect(person.id).toBe("7");
    expect(person.sensors).toEqual([0, 2]);
    expect(person.joints).toHaveLength(JOINT_COUNT);
    expect(person.joints[1]).toMatchObject({ x: 0.3, y: 0.4, z: 0.5, source: "measured", spread: null });
  });

  it("leaves out missing and non-finite joints, and only those", () => {
    const provenances = [...MEASURED];
    provenances[3] = Provenance.MISSING;
    provenances[4] = Provenance.UNSPECIFIED;
    provenances[5] = Provenance.REPAIRED;
    const positions = [...POSITIONS];
    positions[3 * 6 + 1] = NaN;
    const { joints } = decodeTrack(track({ provenances, positions }))!;
    expect(joints.map((j, i) => (j ? -1 : i)).filter((i) => i >= 0)).toEqual([3, 4, 6]);
    expect(joints[5]!.source).toBe("repaired");
  });

  it("counts tracks of a wrong shape instead of drawing them", () => {
    const frame = decodeFrame(create(RoomFrameSchema, {
      timeNs: 1_500_000_000n,
      tracks: [track({ positions: [1, 2, 3] }), track({ covariances: [1] }), track({ id: 12n }), track({ id: 9n })],
    }));
    expect(frame.time).toBe(1.5);
    expect(frame.malformed).toBe(2);
    expect(frame.people.map((p) => p.id)).toEqual(["9", "12"]);
  });

  it("reads every bit of a sensor set", () => {
    expect(bitsOf((1n << 63n) | 1n)).toEqual([0, 63]);
    expect(bitsOf(0n)).toEqual([]);
  });

  it("knows a bone no better than its worse end", () => {
    expect(worse("measured", "inferred")).toBe("inferred");
    expect(worse("repaired", "inferred")).toBe("repaired");
  });
});

describe("covariance ellipsoids", () => {
  it("keeps a diagonal matrix as it is", () => {
    const e = ellipsoid([4, 0, 0, 9, 0, 16])!;
    expect([...e.sigmas].sort()).toEqual([2, 3, 4]);
  });

  it("puts the matrix together again from axes and deviations", () => {
    const m = [0.021, 0.006, -0.004, 0.013, 0.003, 0.03];
    const { axes, sigmas } = ellipsoid([99, ...m], 1)!;
    const full = [0, 1, 2, 1, 3, 4, 2, 4, 5].map((i) => m[i]!);
    for (let r = 0; r < 3; r++) {
      for (let c = 0; c < 3; c++) {
        let sum = 0;
        for (let i = 0; i < 3; i++) sum += sigmas[i]! ** 2 * axes[3 * i + r]! * axes[3 * i + c]!;
        expect(sum).toBeCloseTo(full[3 * r + c]!, 12);
      }
    }
  });

  it("refuses what is no covariance", () => {
    expect(ellipsoid([1, 2, 0, 1, 0, 1])).toBeNull();
    expect(ellipsoid([1, NaN, 0, 1, 0, 1])).toBeNull();
    expect(ellipsoid([1, 0, 0])).toBeNull();
  });
});

describe("raw skeletons", () => {
  // Optical axes (x right, y down, z forward) of a sensor at (1, 2, 3) that looks along the room's x.
  const pose = create(PoseSchema, { translation: { x: 1, y: 2, z: 3 }, rotation: { x: -0.5, y: 0.5, z: -0.5, w: 0.5 } });

  it("stand where the sensor's pose puts them", () => {
    const positions = new Array<number>(75).fill(0);
    positions.splice(0, 3, 0.5, 0.25, 4);
    const confidences = new Array<number>(25).fill(0);
    confidences[0] = 1;
    const [body] = placeBodies(create(ObservationSchema, { sensor: 3, bodies: [{ positions, confidences }] }), rigidOf(pose)!, 4);
    expect(body!.colour).toBe(4);
    expect([...body!.positions.slice(0, 3)]).toEqual([5, 1.5, 2.75]);
    expect(body!.positions[3]).toBeNaN();
  });

  it("need a pose and 25 joints", () => {
    expect(rigidOf(undefined)).toBeNull();
    expect(rigidOf(create(PoseSchema, { translation: {}, rotation: {} }))).toBeNull();
    const odd = create(ObservationSchema, { bodies: [{ positions: [1, 2, 3], confidences: [1] }] });
    expect(placeBodies(odd, rigidOf(pose)!, 0)).toEqual([]);
  });
});

describe("back-off", () => {
  const policy = { firstMs: 500, capMs: 8000, jitter: 0.25 };

  it("doubles up to its cap", () => {
    expect([0, 1, 2, 3, 4, 5, 500].map((n) => delayMs(policy, n, 0))).toEqual([500, 1000, 2000, 4000, 8000, 8000, 8000]);
  });

  it("takes off at most the jitter's share", () => {
    expect(delayMs(policy, 1, 1)).toBe(750);
    expect(delayMs(policy, 1, 0.5)).toBe(875);
  });
});
