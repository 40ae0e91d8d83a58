// A standing person seen from the front, to show a value per joint. Left and right are the person's own, so the
// person's right hand is on the left of the picture, as when one stands before them.

import { JOINT_NAMES, type JointName } from "./joints";

/** Width and height of the picture. */
export const FIGURE = { width: 120, height: 190 };

const HALF: Partial<Record<JointName, [number, number]>> = {
  SpineBase: [0, 98], SpineMid: [0, 74], SpineShoulder: [0, 48], Neck: [0, 36], Head: [0, 16],
  ShoulderLeft: [19, 50], ElbowLeft: [30, 74], WristLeft: [37, 97], HandLeft: [40, 108], HandTipLeft: [43, 120], ThumbLeft: [30, 109],
  HipLeft: [10, 103], KneeLeft: [13, 138], AnkleLeft: [14, 170], FootLeft: [19, 181],
};

/** Where each of the 25 joints is in the picture, canonical order. */
export const FIGURE_JOINTS: readonly (readonly [number, number])[] = JOINT_NAMES.map((name) => {
  const [x, y] = HALF[name] ?? HALF[name.replace("Right", "Left") as JointName]!;
  return [FIGURE.width / 2 + (name.includes("Right") ? -x : x), y];
});

/** `HandTipLeft` as `L hand tip`. */
export function jointLabel(name: JointName): string {
  const side = name.endsWith("Left") ? "L " : name.endsWith("Right") ? "R " : "";
  const words = name.replace(/(Left|Right)$/, "").replace(/(?<=[a-z])(?=[A-Z])/g, " ").toLowerCase();
  return side ? side + words : sentenceCase(words);
}

function sentenceCase(words: string): string {
  return words.charAt(0).toUpperCase() + words.slice(1);
}
