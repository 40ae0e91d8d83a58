"""Reads TRC files as OpenSim's tools do, and lets its inverse kinematics follow them with a pair of legs made to measure."""
import contextlib
import math
import pathlib
import tempfile

import numpy as np
from reading import Readings

# OpenSim writes a log where it is first loaded.
with contextlib.chdir(tempfile.gettempdir()):
    import opensim

opensim.Logger.setLevelString("Error")
#: For each side the sign of OpenSim's Z, which points to the right.
SIDES = {"Right": 1, "Left": -1}
#: The coordinates of the model's joint with the ground that are metres.
PELVIS_PLACE = [f"ground_pelvis_coord_{axis}" for axis in (3, 4, 5)]
#: How near the model's markers must come to those of the file, root mean square of a frame, metres.
MOST_OFF_M = 0.01


def markers(path: str) -> tuple[list[float], dict[str, np.ndarray]]:
    """Times and, by name, frames x 3 in the file's own unit."""
    table = opensim.TimeSeriesTableVec3(path)
    assert table.getTableMetaDataString("Units") == "mm" and float(table.getTableMetaDataString("DataRate")) == 30
    columns = {}
    for label in table.getColumnLabels():
        column = table.getDependentColumn(label)
        columns[label] = np.array([[column[row][axis] for axis in range(3)] for row in range(column.nrow())])
    return list(table.getIndependentColumn()), columns


def legs(places: dict[str, np.ndarray]) -> opensim.Model:
    """A pelvis that moves freely, with thighs in ball joints and shanks in hinges; markers are its joint centres, metres."""

    def length(a: str, b: str) -> float:
        return float(np.linalg.norm(places[a] - places[b], axis=1).mean()) / 1000

    model = opensim.Model()
    ground, none = model.getGround(), opensim.Vec3(0)

    def body(name: str, joint):
        part = opensim.Body(name, 1, none, opensim.Inertia(0.1, 0.1, 0.1, 0, 0, 0))
        model.addBody(part)
        model.addJoint(joint(part))
        return part

    def marker(name: str, part, at: opensim.Vec3):
        model.addMarker(opensim.Marker(name, part, at))

    pelvis = body("pelvis", lambda part: opensim.FreeJoint("ground_pelvis", ground, none, none, part, none, none))
    above = places["SpineBase"] - (places["HipLeft"] + places["HipRight"]) / 2
    marker("SpineBase", pelvis, opensim.Vec3(0, float(np.linalg.norm(above, axis=1).mean()) / 1000, 0))
    for side, sign in SIDES.items():
        hip = opensim.Vec3(0, 0, sign * length("HipLeft", "HipRight") / 2)
        thigh_m, shank_m = length(f"Hip{side}", f"Knee{side}"), length(f"Knee{side}", f"Ankle{side}")
        marker(f"Hip{side}", pelvis, hip)
        thigh = body(f"thigh{side}", lambda part: opensim.BallJoint(f"hip{side}", pelvis, hip, none, part, none, none))
        marker(f"Knee{side}", thigh, opensim.Vec3(0, -thigh_m, 0))
        knee = opensim.Vec3(0, -thigh_m, 0)
        shank = body(f"shank{side}", lambda part: opensim.PinJoint(f"knee{side}", thigh, knee, none, part, none, none))
        marker(f"Ankle{side}", shank, opensim.Vec3(0, -shank_m, 0))
    model.finalizeConnections()
    return model


def follow(path: str, model: opensim.Model, times: list[float], folder: pathlib.Path) -> tuple[dict, np.ndarray]:
    """What inverse kinematics finds: coordinates by name (radians, metres), and how far off the markers are in each frame."""
    tool = opensim.InverseKinematicsTool()
    tool.setModel(model)
    tool.setMarkerDataFileName(path)
    tool.setStartTime(times[0])
    tool.setEndTime(times[-1])
    tool.setOutputMotionFileName(str(folder / "motion.mot"))
    tool.set_report_errors(True)
    tool.setResultsDir(str(folder))
    assert tool.run(), "inverse kinematics did not end well"
    motion = opensim.TimeSeriesTable(str(folder / "motion.mot"))
    scale = math.radians(1) if motion.getTableMetaDataString("inDegrees") == "yes" else 1.0
    found = {}
    for label in motion.getColumnLabels():
        is_angle = label not in PELVIS_PLACE
        found[label] = motion.getDependentColumn(label).to_numpy() * (scale if is_angle else 1.0)
    (errors,) = folder.glob("*marker_errors.sto")
    return found, opensim.TimeSeriesTable(str(errors)).getDependentColumn("marker_error_RMS").to_numpy()


def check_motion(found: dict, off: np.ndarray, places: dict[str, np.ndarray]):
    """The pelvis is where the file has it, and knees bend as people's do: backwards, a lot in a step, never forwards."""
    assert len(off) == len(places["SpineBase"]) and off.max() < MOST_OFF_M, f"markers are up to {off.max():.3f} m off"
    hips = (places["HipLeft"] + places["HipRight"]) / 2000
    pelvis = np.stack([found[coordinate] for coordinate in PELVIS_PLACE], axis=1)
    assert np.linalg.norm(pelvis - hips, axis=1).max() < MOST_OFF_M
    for side in SIDES:
        # About Z, which points to the right: with X ahead and Y up, flexion is negative.
        flexion = -np.degrees(found[f"knee{side}_coord_0"])
        assert flexion.max() > 20 and flexion.min() > -10, f"knee {side}: {flexion.min():.0f} to {flexion.max():.0f} degrees"


readings = Readings()
people, worst = {}, 0.0
for file in readings.files("opensim", ".trc"):
    times, columns = markers(file["path"])
    assert len(times) == readings.expected["frames"], len(times)
    people[file["people"][0]] = {name: places[readings.expected["sampled"]].tolist() for name, places in columns.items()}
    with tempfile.TemporaryDirectory() as folder:
        found, off = follow(file["path"], legs(columns), times, pathlib.Path(folder))
    check_motion(found, off, columns)
    worst = max(worst, float(off.max()))
readings.add("TRC in OpenSim", "joints", people, "opensim", metres=1e-3)
readings.add_check("TRC in OpenSim, followed by its legs", f"joint centres at most {worst * 1000:.2f} mm off (rms of a frame), knees bend backwards")
readings.save()
