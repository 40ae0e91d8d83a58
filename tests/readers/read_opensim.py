"""Reads TRC files as OpenSim's tools do, and lets its inverse kinematics follow them with a model made for the markers."""
import numpy as np
import opensim
from reading import Readings

opensim.Logger.setLevelString("Error")


def markers(path: str) -> tuple[list[float], dict[str, np.ndarray]]:
    """Times and, by name, frames x 3 in the file's own unit."""
    table = opensim.TimeSeriesTableVec3(path)
    assert table.getTableMetaDataString("Units") == "mm" and float(table.getTableMetaDataString("DataRate")) == 30
    columns = {}
    for label in table.getColumnLabels():
        column = table.getDependentColumn(label)
        columns[label] = np.array([[column[row][axis] for axis in range(3)] for row in range(column.nrow())])
    return list(table.getIndependentColumn()), columns


readings = Readings()
people = {}
for file in readings.files("opensim", ".trc"):
    times, columns = markers(file["path"])
    assert len(times) == readings.expected["frames"], len(times)
    people[file["people"][0]] = {name: places[readings.expected["sampled"]].tolist() for name, places in columns.items()}
readings.add("TRC in OpenSim", "joints", people, "opensim", metres=1e-3)
readings.save()
