"""Two real Kinects (recordings with gaps of seconds in them): two agent processes into one server process, calibrated from the recording itself."""
import json
import re
import threading

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

WALK = "Study_8_Kinect_1_Time_3_26_28_PM.csv"
TWO_PEOPLE = "Study_23_Kinect_1_Time_2_35_12_PM.csv"


def play(room, recording):
    """Both Kinects of the recording, in step with each other, over and over."""
    for kinect, name in ((1, "left"), (2, "right")):
        room.start(
            name, "agent", "csv", recording, "--kinect", kinect, "--name", name, "--server", room.url,
            "--align", 2, "--loop",
        )
    room.wait_for(lambda: sum(s.frames_received > 20 for s in room.status().sensors) == 2, "both Kinects")


def watch(room, seconds, frames):
    from posefuse.v1 import room_pb2

    channel, stub = room.stub()
    with channel:
        end = None
        for frame in stub.Watch(room_pb2.WatchRequest()):
            end = end or frame.time_ns + seconds * 10**9
            frames.append(frame)
            if frame.time_ns > end:
                return


@pytest.mark.parametrize("name, people, seconds", [(WALK, 1, 60), (TWO_PEOPLE, 2, 25)])
def test_calibrate_fuse_record_watch_and_fuse_again(room, recordings, name, people, seconds):
    play(room, recordings[name])
    result = json.loads(room.run("calibrate", "--seconds", seconds, "--server", room.url, "--json", code=None))
    assert result["verdict"] in ("passed", "weak") and result["in_force"], result
    pair = result["pairs"][0]
    assert pair["after_mm"] < 0.5 * pair["before_mm"] and pair["after_mm"] < 60, pair

    frames = []
    watcher = threading.Thread(target=watch, args=(room, 14, frames), daemon=True)
    watcher.start()
    room.run("record", "real", "--seconds", 15, "--server", room.url)
    watcher.join(timeout=30)
    seen = [frame for frame in frames if frame.tracks]
    assert len(seen) > 100, f"only {len(seen)} of {len(frames)} frames show anybody"
    most = max(len(frame.tracks) for frame in seen)
    assert most >= people, f"never more than {most} of {people} people"
    # In the recordings' gaps, which come where playing has got to, one sensor is alone.
    both = sum(bin(track.sensors).count("1") == 2 for frame in seen for track in frame.tracks)
    assert both > 0.15 * len(seen), "people are rarely fused from both sensors"

    again = room.run("refuse", "real", "--takes", room.takes, "--out", "again")
    assert re.search(r"identical", again), again
    info = room.take_info("real")
    assert info["dropped"] == 0 and info["frames"] > 100 and sorted(info["sensors"]) == ["left", "right"]
    assert observations_in(room.takes / "real.mcap") == observations_in(room.takes / "again.mcap")
    assert min(observations_in(room.takes / "real.mcap").values()) > 60


def observations_in(take):
    """How many frames of each sensor a take holds, by the Python `mcap` package."""
    counts = {0: 0, 1: 0}
    with take.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, _, _, message in reader.iter_decoded_messages(topics=["/inputs"]):
            if message.HasField("observation"):
                counts[message.observation.sensor] += 1
    return counts
