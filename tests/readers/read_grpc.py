"""The fused people of a take as a server streams them to a gRPC client, against the file as the Python MCAP reader has them."""
import pathlib
import socket
import subprocess
import sys

import grpc
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from reading import Readings

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "clients/python"))
from posefuse.v1 import room_pb2, room_pb2_grpc  # noqa: E402

#: An instant that is looked at has a frame this near.
NEAR_NS = 20_000_000


def recorded(take: pathlib.Path) -> dict:
    """The fused frames of a take by number, each with its civil time."""
    with take.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return {frame.number: (message.log_time, frame) for _, _, message, frame in reader.iter_decoded_messages(topics=["/frames"])}


def replayed(posefuse: str, take: pathlib.Path) -> dict:
    """The same from a server."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{probe.getsockname()[1]}"
    command = [posefuse, "server", "--listen", address, "--takes", take.parent, "--calibration", take.parent / "none.toml"]
    server = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        with grpc.insecure_channel(address) as channel:
            grpc.channel_ready_future(channel).result(timeout=30)
            request = room_pb2.ReplayTakeRequest(name=take.stem, speed=0)
            events = list(room_pb2_grpc.RoomStub(channel).ReplayTake(request, timeout=60))
    finally:
        server.terminate()
        server.wait(timeout=20)
    return {event.frame.number: event.frame for event in events if event.HasField("frame")}


def add_places(people: dict, frame, joints: list[str]):
    for track in frame.tracks:
        for index, joint in enumerate(joints):
            place = list(track.positions[3 * index : 3 * index + 3])
            people.setdefault(f"person{track.id}", {}).setdefault(joint, []).append(place)


readings = Readings()
take = pathlib.Path(readings.expected["take"])
sent, found = recorded(take), replayed(sys.argv[3], take)
assert sorted(found) == sorted(sent), "frames are missing"
joints, used, there, expected = readings.expected["names"]["joints"], [], {}, {}
for index, instant in enumerate(readings.expected["unix_ns"]):
    number = min(sent, key=lambda number: abs(sent[number][0] - instant))
    time_ns, frame = sent[number]
    if abs(time_ns - instant) < NEAR_NS and len(frame.tracks) == len(readings.expected["people"]):
        used.append(index)
        add_places(there, found[number], joints)
        add_places(expected, frame, joints)
readings.add("fused people by grpcio", "joints", there, "room", frames=used, sent=expected)
readings.save()
