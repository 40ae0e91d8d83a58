#!/usr/bin/env python3
"""MediaPipe Pose: pushes its 33 landmarks, from a camera or from recorded landmarks.

    pip install mediapipe opencv-python
    python mediapipe_pose.py --camera 0 --model pose_landmarker_full.task --fov 70
    python mediapipe_pose.py landmarks.jsonl --fov 70

What a single colour camera gives: directions (where in the picture a joint is) and the body's shape as the network knows
it. What it cannot give: distance. The body is put where its shape, in the size that MediaPipe takes people to have,
covers the landmarks in the picture, so somebody 10 % taller than that stands 10 % too far away, and depth along the line
of sight is a guess for every limb. Such joints go to the room as guesses (confidence at most 0.5): they help where no
depth sensor looks, and are outvoted where one does. With a depth image that is aligned to the colour image, distances
are measured, and joints whose landmark lies on the body's surface go with MediaPipe's own visibility.

Recorded landmarks are one JSON object a line:
  {"t": 1.5, "width": 1280, "height": 720, "poses": [
     {"image": [[x, y, visibility], ...33], "world": [[x, y, z], ...33], "depth_mm": [2510, 0, ...33]}]}
image: shares of width and height. world: metres from the middle of the hips, x right, y down, z forward as in the
picture. depth_mm: along the optical axis at the landmark's pixel, 0: none; leave it out where there is no depth.
The picture must not be mirrored (many webcams' programs do that), or left is right in the room.
"""
import json
import math
import statistics
import time
from collections.abc import Iterable, Iterator

import common
import posefuse
from posefuse import Body, Joint

NAMES = posefuse.JOINT_SETS["blaze-pose"]
#: Shoulders and hips: what holds the body in place.
TORSO = [NAMES.index(name) for name in ("left_shoulder", "right_shoulder", "left_hip", "right_hip")]
#: A landmark is used from this visibility on.
VISIBLE = 0.5
#: What a joint without measured distance is worth at most.
GUESS = 0.5
#: Depth further than this from where the body's shape has the joint belongs to something else, metres.
REACH_M = 0.3


class Camera:
    """A pinhole camera, by its horizontal field of view: square pixels, the axis through the picture's middle."""

    def __init__(self, width: int, height: int, fov_deg: float):
        self.width, self.height = width, height
        self.focal = 0.5 * width / math.tan(math.radians(fov_deg) / 2)

    def ray(self, x: float, y: float) -> tuple[float, float]:
        """x / z and y / z of what is seen at these shares of width and height."""
        return (x - 0.5) * self.width / self.focal, (y - 0.5) * self.height / self.focal


def place(world: list, rays: list, weights: list, distance: float | None = None) -> tuple[float, float, float]:
    """Where the body's origin must be for its joints to lie on their rays, least squares; `distance`: tz, if it is known.

    Two equations a joint, linear in the place t: (X + tx) - u (Z + tz) = 0 and (Y + ty) - v (Z + tz) = 0.
    """
    total = sum(weights)
    if total <= 0:
        raise ValueError("no landmark is visible")

    def mean(values: list) -> float:
        return sum(w * value for w, value in zip(weights, values)) / total

    u, v = [ray[0] for ray in rays], [ray[1] for ray in rays]
    a = [u[i] * p[2] - p[0] for i, p in enumerate(world)]
    b = [v[i] * p[2] - p[1] for i, p in enumerate(world)]
    # tx and ty follow from tz (tx = mean(a) + mean(u) tz); what is left is one equation in tz.
    mean_u, mean_v, mean_a, mean_b = mean(u), mean(v), mean(a), mean(b)
    tz = distance
    if tz is None:
        spread = sum(w * ((u[i] - mean_u) ** 2 + (v[i] - mean_v) ** 2) for i, w in enumerate(weights))
        if spread < 1e-9 * total:
            raise ValueError("the visible landmarks coincide")
        slopes = ((u[i] - mean_u) * (mean_a - a[i]) + (v[i] - mean_v) * (mean_b - b[i]) for i in range(len(world)))
        tz = sum(w * slope for w, slope in zip(weights, slopes)) / spread
    return mean_a + mean_u * tz, mean_b + mean_v * tz, tz


def body(number: int, pose: dict, camera: Camera) -> Body | None:
    """One pose in optical axes, or nobody where too little of it is seen."""
    rays = [camera.ray(x, y) for x, y, _ in pose["image"]]
    seen = [min(max(visibility, 0.0), 1.0) if visibility >= VISIBLE else 0.0 for _, _, visibility in pose["image"]]
    world = pose["world"]
    depth = [value / 1000 for value in pose.get("depth_mm", [0] * len(NAMES))]
    measured = [depth[i] - world[i][2] for i in TORSO if depth[i] > 0 and seen[i]]
    try:
        tx, ty, tz = place(world, rays, seen, statistics.median(measured) if measured else None)
    except ValueError:
        return None
    if tz <= 0:
        return None
    joints = {}
    for i, name in enumerate(NAMES):
        if seen[i]:
            z = world[i][2] + tz
            if measured and depth[i] > 0 and abs(depth[i] - z) < REACH_M:
                joints[name] = Joint(rays[i][0] * depth[i], rays[i][1] * depth[i], depth[i], seen[i])
            else:
                joints[name] = Joint(world[i][0] + tx, world[i][1] + ty, z, min(seen[i], GUESS))
    return Body(number, joints)


def frames(records: Iterable[dict], fov_deg: float) -> Iterator[common.Frame]:
    """Frames from records as in a recording. MediaPipe numbers its poses anew in each picture: so are the bodies."""
    for record in records:
        camera = Camera(record["width"], record["height"], fov_deg)
        found = (body(number, pose, camera) for number, pose in enumerate(record["poses"], start=1))
        yield record["t"], [one for one in found if one is not None]


def camera_records(device: int, model: str, people: int) -> Iterator[dict]:
    """Records from a camera, for ever."""
    import cv2
    import mediapipe
    from mediapipe.tasks.python import BaseOptions, vision

    capture = cv2.VideoCapture(device)
    if not capture.isOpened():
        raise OSError(f"camera {device} does not open: is it plugged in, and does no other program have it?")
    options = vision.PoseLandmarkerOptions(
        base_options=BaseOptions(model_asset_path=model), running_mode=vision.RunningMode.VIDEO, num_poses=people)
    with vision.PoseLandmarker.create_from_options(options) as landmarker:
        while True:
            grabbed, picture = capture.read()
            if not grabbed:
                raise OSError(f"camera {device} gives no pictures any more")
            now = time.monotonic()
            image = mediapipe.Image(image_format=mediapipe.ImageFormat.SRGB, data=cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))
            result = landmarker.detect_for_video(image, int(now * 1000))
            poses = [
                {"image": [[m.x, m.y, m.visibility] for m in marks], "world": [[m.x, m.y, m.z] for m in world]}
                for marks, world in zip(result.pose_landmarks, result.pose_world_landmarks)
            ]
            yield {"t": now, "width": picture.shape[1], "height": picture.shape[0], "poses": poses}


def main() -> None:
    parser = common.options(__doc__, "mediapipe")
    parser.add_argument("file", nargs="?", help="recorded landmarks; `-`: on standard input, live")
    parser.add_argument("--camera", type=int, metavar="NUMBER", help="from this camera")
    parser.add_argument("--model", metavar="FILE", help="with --camera: MediaPipe's pose_landmarker .task file")
    parser.add_argument("--people", type=int, default=1, help="with --camera: how many are looked for [1]")
    parser.add_argument("--fov", type=float, required=True, metavar="DEG", help="the camera's horizontal field of view")
    args = parser.parse_args()
    if (args.camera is None) == (args.file is None):
        parser.error("give either recorded landmarks or --camera")
    if args.camera is not None:
        if not args.model:
            parser.error("--camera needs --model: a pose_landmarker .task file from MediaPipe's model page")
        records = camera_records(args.camera, args.model, args.people)
        common.run(args, frames(records, args.fov), joint_set="blaze-pose", model="MediaPipe Pose", live=True)
        return
    with common.lines_of(args.file) as lines:
        records = (json.loads(line) for line in lines if line.strip())
        common.run(args, frames(records, args.fov), joint_set="blaze-pose", model="MediaPipe Pose", live=args.file == "-")


if __name__ == "__main__":
    main()
