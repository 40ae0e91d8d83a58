"""`posefuse agent nite` and `azure` with libraries of our own that have the same functions as the makers' (devices/tests/c)."""
import shutil
import subprocess
import sys

import pytest
from conftest import POSEFUSE, ROOT


def compile_library(folder, name, source, *options):
    if shutil.which("cc") is None or not sys.platform.startswith("linux"):
        pytest.skip("SKIPPED: no C compiler (apt install gcc)")
    command = ["cc", "-shared", "-fPIC", "-o", folder / name, ROOT / "devices/tests/c" / source, *options]
    subprocess.run(list(map(str, command)), check=True)


def first_seen(room, name):
    import posefuse

    with posefuse.Room(room.address) as reader:
        for frame in reader.watch_sensors(name, seconds=15):
            if frame.bodies:
                return frame.bodies
    raise AssertionError(f"{name} saw nobody: {[p.log.read_text()[-2000:] for p in room.programs[1:]]}")


def test_a_makers_tracker_is_a_sensor_of_the_room(room, tmp_path):
    compile_library(tmp_path, "libNiTE2.so", "nite.c", "-DFAKE_MINOR=2", "-DFAKE_ITSELF", "-pthread")
    compile_library(tmp_path, "libk4a.so.1.4", "azure.c", "-DSENSOR", "-DFAKE_ITSELF")
    compile_library(tmp_path, "libk4abt.so.1.1", "azure.c")
    (tmp_path / "NiTE2").mkdir()
    (tmp_path / "NiTE2/s.dat").write_text("x")
    for kind in ("nite", "azure"):
        room.start(kind, "agent", kind, "--name", kind, "--library", tmp_path, "--server", room.url)
    room.wait_for(lambda: len(room.status().sensors) == 2, "both agents")
    nite = first_seen(room, "nite")[7]
    assert nite["Head"][:3] == pytest.approx((0.3, -0.5, 2.5), abs=1e-4)
    assert nite["AnkleLeft"].confidence == 0.5 and "AnkleRight" not in nite
    azure = first_seen(room, "azure")[10]
    assert azure["ShoulderLeft"][:3] == pytest.approx((0.105, -0.205, 3.005), abs=1e-4)
    assert azure["ShoulderLeft"].confidence == 0.5 and azure["ElbowLeft"].confidence == pytest.approx(0.9)
    models = {sensor.info.name: (sensor.info.joint_set, sensor.fov_horizontal_deg) for sensor in room.status().sensors}
    assert models["nite"][0] == "nite" and models["azure"] == ("azure-kinect", 75)


@pytest.mark.parametrize("kind, words", [("nite", ["NITE2_REDIST64", "agent openni"]), ("azure", ["K4ABT_LIBRARY_PATH", "libk4abt1.1"])])
def test_without_the_library_it_is_said_what_to_install(tmp_path, kind, words):
    command = [POSEFUSE, "agent", kind, "--name", "x", "--library", str(tmp_path), "--server", "127.0.0.1:9"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30)
    assert done.returncode == 1, done.stderr
    for word in words:
        assert word in done.stderr, done.stderr
