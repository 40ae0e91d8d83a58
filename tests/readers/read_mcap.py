"""Takes by the Python MCAP reader, by Foxglove's own schemas and by rerun's checker; Parquet by pyarrow."""
import bisect
import math
import pathlib
import subprocess
import sys

import numpy as np
import pyarrow.parquet
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from reading import Readings


def read_truth(readings: Readings, take: pathlib.Path):
    """The true people."""
    times, rows, joints = [], [], readings.expected["names"]["joints"]
    with take.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for schema, _, message, truth in reader.iter_decoded_messages(topics=["/truth"]):
            assert schema.name == "posefuse.v1.Truth", schema.name
            times.append(message.log_time)
            rows.append({f"true{person.id}": person.positions for person in truth.people})
    people = {}
    for instant in readings.expected["unix_ns"]:
        for who, positions in between(times, rows, instant).items():
            for index, joint in enumerate(joints):
                people.setdefault(who, {}).setdefault(joint, []).append(positions[3 * index : 3 * index + 3].tolist())
    readings.add("MCAP by the Python reader", "joints", people, "room")


def between(times: list[int], rows: list[dict], instant: int) -> dict:
    """Everybody at an instant between messages: a cubic through the four nearest ones (Lagrange)."""
    first = min(max(bisect.bisect_right(times, instant) - 2, 0), len(times) - 4)
    near = range(first, first + 4)
    weights = {
        index: math.prod((instant - times[other]) / (times[index] - times[other]) for other in near if other != index) for index in near
    }
    return {who: sum(weights[index] * np.array(rows[index][who]) for index in near) for who in rows[first]}


def read_scene(readings: Readings, take: pathlib.Path):
    """What Foxglove draws, decoded by the classes that Foxglove publishes: a ball for each joint of the fused people."""
    frames, scenes, transforms = {}, {}, 0
    with take.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, _, message, frame in reader.iter_decoded_messages(topics=["/frames"]):
            frames[message.log_time] = frame
        for schema, _, message in reader.iter_messages(topics=["/scene", "/tf"]):
            check_schema(schema)
            if schema.name == "foxglove.SceneUpdate":
                scenes[message.log_time] = SceneUpdate.FromString(message.data)
            else:
                transforms += len(FrameTransforms.FromString(message.data).transforms)
    assert transforms > 0, "no sensor stands anywhere"
    joints, used, found, sent = readings.expected["names"]["joints"], [], {}, {}
    for index, instant in enumerate(readings.expected["unix_ns"]):
        at = min(scenes, key=lambda time: abs(time - instant))
        frame, entities = frames[at], scenes[at].entities
        whole = all(len(entity.spheres) == len(joints) for entity in entities)
        if len(entities) != len(readings.expected["people"]) or not whole:
            continue
        used.append(index)
        for entity, track in zip(entities, frame.tracks, strict=True):
            assert entity.frame_id == "room" and entity.lifetime.ToNanoseconds() > 0 and entity.lines
            for number, (joint, ball) in enumerate(zip(joints, entity.spheres)):
                at_ball = ball.pose.position
                found.setdefault(entity.id, {}).setdefault(joint, []).append([at_ball.x, at_ball.y, at_ball.z])
                sent.setdefault(entity.id, {}).setdefault(joint, []).append(list(track.positions[3 * number : 3 * number + 3]))
    readings.add("MCAP's scene by Foxglove's schemas", "joints", found, "room", frames=used, sent=sent)


def check_schema(schema):
    """The schema that the file carries says of every field what Foxglove's says."""
    carried = {}
    for file in FileDescriptorSet.FromString(schema.data).file:
        for message in file.message_type:
            carried[f"{file.package}.{message.name}"] = {(field.number, field.name, field.type, field.label) for field in message.field}
    theirs = {"foxglove.SceneUpdate": SceneUpdate, "foxglove.FrameTransforms": FrameTransforms}[schema.name]
    todo = [theirs.DESCRIPTOR]
    while todo:
        message = todo.pop()
        wanted = {(field.number, field.name, field.type, 3 if field.is_repeated else 1) for field in message.fields}
        assert carried[message.full_name] == wanted, f"{message.full_name}: {carried[message.full_name] ^ wanted}"
        todo += [field.message_type for field in message.fields if field.message_type]


def check_by_rerun(readings: Readings, take: pathlib.Path):
    rerun = pathlib.Path(sys.executable).with_name("rerun")
    done = subprocess.run([rerun, "mcap", "check", take], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    # A reader that takes everything would say nothing of a file that was cut off.
    torn = take.with_name("torn.mcap")
    torn.write_bytes(take.read_bytes()[: take.stat().st_size // 2])
    try:
        assert subprocess.run([rerun, "mcap", "check", torn], capture_output=True, timeout=60).returncode != 0
    finally:
        torn.unlink()
    readings.add_check("MCAP by `rerun mcap check`", "whole, and half of it is told from it")


def read_parquet(readings: Readings):
    (file,) = readings.files("plain", ".parquet")
    table = pyarrow.parquet.read_table(file["path"]).to_pydict()
    wanted, people = set(readings.expected["sampled"]), {}
    for frame, who, joint, *place in zip(*(table[name] for name in ("frame", "person", "joint", "x_m", "y_m", "z_m"))):
        if frame in wanted:
            people.setdefault(who, {}).setdefault(joint, []).append(place)
    readings.add("Parquet by pyarrow", "joints", people, "room")


readings = Readings()
take = pathlib.Path(readings.expected["take"])
read_truth(readings, take)
read_scene(readings, take)
read_parquet(readings)
check_by_rerun(readings, take)
readings.save()
