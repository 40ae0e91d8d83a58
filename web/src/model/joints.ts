// The 25 canonical joints (Kinect v2's), in the order of the arrays on the wire, and the bones between them.
// Left and right are the person's own.

export const JOINT_NAMES = [
  "SpineBase", "SpineMid", "Neck", "Head",
  "ShoulderLeft", "ElbowLeft", "WristLeft", "HandLeft",
  "ShoulderRight", "ElbowRight", "WristRight", "HandRight",
  "HipLeft", "KneeLeft", "AnkleLeft", "FootLeft",
  "HipRight", "KneeRight", "AnkleRight", "FootRight",
  "SpineShoulder", "HandTipLeft", "ThumbLeft", "HandTipRight", "ThumbRight",
] as const;

export type JointName = (typeof JOINT_NAMES)[number];

export const JOINT_COUNT = JOINT_NAMES.length;

export function jointIndex(name: JointName): number {
  return JOINT_NAMES.indexOf(name);
}

/** Pairs of joint indices, the end nearer to the pelvis first. */
export const BONES: readonly (readonly [number, number])[] = (
  [
    ["SpineBase", "SpineMid"],
    ["SpineMid", "SpineShoulder"],
    ["SpineShoulder", "Neck"],
    ["Neck", "Head"],
    ["SpineShoulder", "ShoulderLeft"],
    ["ShoulderLeft", "ElbowLeft"],
    ["ElbowLeft", "WristLeft"],
    ["WristLeft", "HandLeft"],
    ["HandLeft", "HandTipLeft"],
    ["WristLeft", "ThumbLeft"],
    ["SpineShoulder", "ShoulderRight"],
    ["ShoulderRight", "ElbowRight"],
    ["ElbowRight", "WristRight"],
    ["WristRight", "HandRight"],
    ["HandRight", "HandTipRight"],
    ["WristRight", "ThumbRight"],
    ["SpineBase", "HipLeft"],
    ["HipLeft", "KneeLeft"],
    ["KneeLeft", "AnkleLeft"],
    ["AnkleLeft", "FootLeft"],
    ["SpineBase", "HipRight"],
    ["HipRight", "KneeRight"],
    ["KneeRight", "AnkleRight"],
    ["AnkleRight", "FootRight"],
  ] satisfies [JointName, JointName][]
).map(([parent, child]) => [jointIndex(parent), jointIndex(child)] as const);

/** The joints whose speed is plotted. */
export const PLOTTED_JOINTS: readonly { joint: number; label: string }[] = [
  { joint: jointIndex("SpineBase"), label: "Pelvis" },
  { joint: jointIndex("Head"), label: "Head" },
  { joint: jointIndex("HandLeft"), label: "L hand" },
  { joint: jointIndex("HandRight"), label: "R hand" },
  { joint: jointIndex("FootLeft"), label: "L foot" },
  { joint: jointIndex("FootRight"), label: "R foot" },
];
