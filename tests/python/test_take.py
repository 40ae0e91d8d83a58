"""A take made by the program, read by the Python `mcap` package with the schemas that the file itself carries."""
import collections

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

SENSORS, SECONDS = 3, 10


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    import subprocess

    from conftest import POSEFUSE

    folder = tmp_path_factory.mktemp("simulated")
    command = [POSEFUSE, "simulate", "--out", "walk", "--seconds", SECONDS, "--sensors", SENSORS, "--takes", folder]
    subprocess.run(list(map(str, command)), check=True, stdin=subprocess.DEVNULL)
    return folder / "walk.mcap"


@pytest.fixture(scope="module")
def messages(take):
    by_topic = collections.defaultdict(list)
    with take.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            by_topic[channel.topic].append((schema.name, message, decoded))
    return by_topic


def test_every_topic_decodes_with_its_embedded_schema(messages):
    schemas = {topic: rows[0][0] for topic, rows in messages.items()}
    assert schemas["/inputs"] == "posefuse.v1.EngineInput"
    assert schemas["/frames"] == "posefuse.v1.RoomFrame"
    assert schemas["/scene"] == "foxglove.SceneUpdate"
    assert schemas["/tf"] == "foxglove.FrameTransforms"


def test_the_fused_person_stands_on_the_floor_and_walks(messages):
    frames = [decoded for _, _, decoded in messages["/frames"] if decoded.tracks]
    assert len(frames) > 20 * (SECONDS - 2)
    head, ankle = 3, 14
    heads = [frame.tracks[0].positions[3 * head : 3 * head + 3] for frame in frames]
    ankles = [frame.tracks[0].positions[3 * ankle : 3 * ankle + 3] for frame in frames]
    upright = [h[2] - a[2] for h, a in zip(heads, ankles)]
    assert 1.1 < sorted(upright)[len(upright) // 2] < 2.0, "the head is not a body's height above the ankle"
    assert min(h[2] for h in heads) > 0.5
    span = max(h[0] for h in heads) - min(h[0] for h in heads) + max(h[1] for h in heads) - min(h[1] for h in heads)
    assert span > 0.3, "nobody moved"
    times = [frame.time_ns for frame in frames]
    assert times == sorted(set(times)), "frame times do not increase"


def test_the_scene_shows_people_that_vanish_and_the_sensors_places(messages):
    scenes = [decoded for _, _, decoded in messages["/scene"]]
    entities = [entity for scene in scenes for entity in scene.entities]
    assert entities and all(entity.frame_id == "room" for entity in entities)
    assert all(entity.lifetime.ToNanoseconds() > 0 for entity in entities), "people would never vanish"
    assert all(0 < len(entity.spheres) <= 25 and entity.lines for entity in entities)
    children = {transform.child_frame_id for _, _, decoded in messages["/tf"] for transform in decoded.transforms}
    assert children == {f"sensor/sim{number}" for number in range(1, SENSORS + 1)}


def test_the_take_carries_its_configuration_and_calibration(take):
    with take.open("rb") as stream:
        attachments = {attachment.name: attachment.data for attachment in make_reader(stream).iter_attachments()}
    assert any(name.endswith("config.toml") for name in attachments), attachments.keys()
    calibration = next(data for name, data in attachments.items() if name.endswith("calibration.toml"))
    assert calibration.decode().count("[sensors.") >= SENSORS
