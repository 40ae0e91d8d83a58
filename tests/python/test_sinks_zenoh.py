"""People live over Zenoh, read by Eclipse's own client, and their bones as ROS 2's /tf, read by a ROS 2 SDK that knows rmw_zenoh.

Zenoh is not in the usual build. To run this: `cargo build --features zenoh`, `pip install -r tests/python/zenoh.txt`, and
POSEFUSE_ZENOH=target/debug/posefuse.
"""
import os
import struct
import threading

import conftest
import numpy as np
import pytest
from conftest import Room, free_port
from test_sinks_net import SENSORS, import_calibration, matrix

PROGRAM = os.environ.get("POSEFUSE_ZENOH")
if not PROGRAM:
    pytest.skip("SKIPPED: a build with Zenoh is not named (POSEFUSE_ZENOH)", allow_module_level=True)
zenoh = pytest.importorskip("zenoh", reason="SKIPPED: pip install -r tests/python/zenoh.txt")
sdk = pytest.importorskip("zenoh_ros2_sdk", reason="SKIPPED: pip install -r tests/python/zenoh.txt")

TYPE_HASH = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
RULE = "=" * 80
TF_MESSAGE = f"""geometry_msgs/TransformStamped[] transforms
{RULE}
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
{RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
{RULE}
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
{RULE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{RULE}
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
"""


class ZenohRoom(Room):
    def __init__(self, folder):
        self.port = free_port()
        self.config = folder / "server.toml"
        self.config.write_text(
            f'[sinks.zenoh]\nenabled = true\nmode = "peer"\nconnect = []\nlisten = ["tcp/127.0.0.1:{self.port}"]\nrate_hz = 0.0\n'
        )
        super().__init__(folder)

    def start(self, name, *arguments):
        if arguments[0] != "server":
            return super().start(name, *arguments)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(conftest, "POSEFUSE", PROGRAM)
            return super().start(name, *arguments, "--config", self.config)

    def session(self):
        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("connect/endpoints", f'["tcp/127.0.0.1:{self.port}"]')
        config.insert_json5("scouting/multicast/enabled", "false")
        return zenoh.open(config)


@pytest.fixture
def room(tmp_path, client):
    room = ZenohRoom(tmp_path)
    import_calibration(room)
    for number in range(1, SENSORS + 1):
        words = ["--sensor", number, "--sensors", SENSORS, "--people", 2]
        room.start(f"sim{number}", "agent", "--name", f"sim{number}", "--server", room.url, "sim", *words)
    room.wait_for(lambda: room.status().people == 2, "two people")
    yield room
    room.close()


def test_zenoh_and_ros_get_what_grpc_gets_though_somebody_stands_still(room):
    import posefuse
    from posefuse.people import frame_of
    from posefuse.v1 import types_pb2

    samples, transforms, hold = [], [], threading.Event()
    good, still = room.session(), room.session()
    try:
        good.declare_subscriber("posefuse/frames", samples.append)
        # Takes the first and no other.
        still.declare_subscriber("posefuse/**", lambda _: hold.wait(60))
        tf = sdk.ROS2Subscriber(
            "/tf", "tf2_msgs/msg/TFMessage", transforms.append, msg_definition=TF_MESSAGE, router_port=room.port, type_hash=TYPE_HASH
        )
        tokens = [str(reply.ok.key_expr) for reply in good.liveliness().get("@ros2_lv/**")]
        with posefuse.Room(room.address) as reader:
            reference = {frame.number: frame for frame in reader.watch(seconds=5)}
        taken = list(samples)
        tf.close()
        tf.session_mgr.session.close()
    finally:
        hold.set()
        good.close()
        still.close()
    assert any(f"/MP/%/%/posefuse/%tf/tf2_msgs::msg::dds_::TFMessage_/{TYPE_HASH}/" in token for token in tokens), tokens
    compared, numbers = 0, []
    for sample in taken:
        frame = frame_of(types_pb2.RoomFrame.FromString(sample.payload.to_bytes()))
        numbers.append(struct.unpack("<Q", sample.attachment.to_bytes())[0])
        if (same := reference.get(frame.number)) is None:
            continue
        assert frame.people == same.people and frame.time_ns == same.time_ns
        assert abs(frame.unix_ns - same.unix_ns) < 1_000_000
        compared += len(frame.people) > 0
    assert compared > 20
    assert set(np.diff(numbers)) == {1}, "the healthy subscriber lost nothing beside one that stands still"
    assert_bones_are_where_joints_are(transforms, reference)


def assert_bones_are_where_joints_are(messages, reference):
    by_time = {frame.unix_ns // 1_000_000: frame for frame in reference.values()}
    off = []
    for message in messages:
        origins, axes = {"room": np.zeros(3)}, {"room": np.eye(3)}
        for each in message.transforms:
            parent, at, turn = each.header.frame_id, each.transform.translation, each.transform.rotation
            origins[each.child_frame_id] = origins[parent] + axes[parent] @ [at.x, at.y, at.z]
            axes[each.child_frame_id] = axes[parent] @ matrix(turn.x, turn.y, turn.z, turn.w)
        stamp = message.transforms[0].header.stamp
        frame = by_time.get((stamp.sec * 1_000_000_000 + stamp.nanosec) // 1_000_000)
        for person in frame.people if frame else []:
            bone, joint = origins.get(f"person-{person.id}/LeftHand"), person.joints.get("WristLeft")
            if bone is not None and joint is not None:
                off.append(np.linalg.norm(bone - [joint.x, joint.y, joint.z]))
    assert len(off) > 20 and np.median(off) < 0.06, f"{len(off)} wrists, {np.median(off):.3f} m off"
