"""The joints of each tracker in the order of its frames, as `skeleton/src/joint_set/tables.rs` has them."""

#: Names of the joints, by the joint set's name on the wire.
JOINT_SETS: dict[str, tuple[str, ...]] = {
    "kinect-v2": (
        "SpineBase", "SpineMid", "Neck", "Head", "ShoulderLeft", "ElbowLeft", "WristLeft", "HandLeft",
        "ShoulderRight", "ElbowRight", "WristRight", "HandRight", "HipLeft", "KneeLeft", "AnkleLeft", "FootLeft",
        "HipRight", "KneeRight", "AnkleRight", "FootRight", "SpineShoulder", "HandTipLeft", "ThumbLeft",
        "HandTipRight", "ThumbRight",
    ),
    "kinect-v1": (
        "HipCenter", "Spine", "ShoulderCenter", "Head", "ShoulderLeft", "ElbowLeft", "WristLeft", "HandLeft",
        "ShoulderRight", "ElbowRight", "WristRight", "HandRight", "HipLeft", "KneeLeft", "AnkleLeft", "FootLeft",
        "HipRight", "KneeRight", "AnkleRight", "FootRight",
    ),
    "nite": (
        "Head", "Neck", "LeftShoulder", "RightShoulder", "LeftElbow", "RightElbow", "LeftHand", "RightHand", "Torso",
        "LeftHip", "RightHip", "LeftKnee", "RightKnee", "LeftFoot", "RightFoot",
    ),
    "nuitrack": (
        "Head", "Neck", "Torso", "Waist", "Collar", "LeftShoulder", "LeftElbow", "LeftWrist", "LeftHand",
        "RightShoulder", "RightElbow", "RightWrist", "RightHand", "LeftHip", "LeftKnee", "LeftAnkle", "RightHip",
        "RightKnee", "RightAnkle",
    ),
    "azure-kinect": (
        "Pelvis", "SpineNavel", "SpineChest", "Neck", "ClavicleLeft", "ShoulderLeft", "ElbowLeft", "WristLeft",
        "HandLeft", "HandTipLeft", "ThumbLeft", "ClavicleRight", "ShoulderRight", "ElbowRight", "WristRight",
        "HandRight", "HandTipRight", "ThumbRight", "HipLeft", "KneeLeft", "AnkleLeft", "FootLeft", "HipRight",
        "KneeRight", "AnkleRight", "FootRight", "Head", "Nose", "EyeLeft", "EarLeft", "EyeRight", "EarRight",
    ),
    "blaze-pose": (
        "nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye", "right_eye_outer",
        "left_ear", "right_ear", "mouth_left", "mouth_right", "left_shoulder", "right_shoulder", "left_elbow",
        "right_elbow", "left_wrist", "right_wrist", "left_pinky", "right_pinky", "left_index", "right_index",
        "left_thumb", "right_thumb", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle",
        "left_heel", "right_heel", "left_foot_index", "right_foot_index",
    ),
}

#: The joints of fused people and of `Room.watch_sensors`: those of Kinect v2.
CANONICAL = JOINT_SETS["kinect-v2"]


def names_of(joint_set: str) -> tuple[str, ...]:
    """The joints of `joint_set`; a `ValueError` names the sets there are."""
    try:
        return JOINT_SETS[joint_set]
    except KeyError:
        raise ValueError(f"no joint set is called {joint_set!r}; there are {', '.join(JOINT_SETS)}") from None
