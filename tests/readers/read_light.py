"""C3D by ezc3d, BVH by bvhio, CSV by duckdb."""
import bvhio
import duckdb
import ezc3d
from reading import Readings


def read_c3d(readings: Readings):
    (file,) = readings.files("plain", ".c3d")
    points = ezc3d.c3d(file["path"])
    labels, places = points["parameters"]["POINT"]["LABELS"]["value"], points["data"]["points"]
    people = {}
    for index, label in enumerate(labels):
        who, joint = label.split(":")
        people.setdefault(who, {})[joint] = places[:3, index, readings.expected["sampled"]].T.tolist()
    readings.add("C3D by ezc3d", "joints", people, "room", metres=1e-3)


def read_bvh(readings: Readings):
    people, names = {}, set(readings.expected["names"]["bones"])
    for file in readings.files("plain", ".bvh"):
        root = bvhio.readAsHierarchy(file["path"])
        found = people.setdefault(file["people"][0], {})
        for frame in readings.expected["sampled"]:
            root.loadPose(frame)
            for joint, _, _ in root.layout():
                if joint.Name in names:
                    found.setdefault(joint.Name, []).append(list(joint.PositionWorld))
    readings.add("BVH by bvhio", "bones", people, "y-up", metres=0.01)


def read_csv(readings: Readings):
    (path,) = [file["path"] for file in readings.files("plain", ".csv") if "bones" not in file["path"]]
    joints = readings.expected["names"]["joints"]
    columns = ", ".join(f"{joint}_{axis}_m" for joint in joints for axis in "xyz")
    frames = ", ".join(map(str, readings.expected["sampled"]))
    people = {}
    for who, *row in duckdb.sql(f"select person, {columns} from '{path}' where frame in ({frames}) order by person, frame").fetchall():
        for index, joint in enumerate(joints):
            people.setdefault(who, {}).setdefault(joint, []).append(row[3 * index : 3 * index + 3])
    readings.add("CSV by duckdb", "joints", people, "room")


readings = Readings()
read_c3d(readings)
read_bvh(readings)
read_csv(readings)
readings.save()
