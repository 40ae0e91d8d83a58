"""Runs the real `posefuse` program (POSEFUSE, else target/debug/posefuse) for clients that are not ours."""
import contextlib
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tarfile
import time

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CLIENT = ROOT / "clients/python"
POSEFUSE = os.environ.get("POSEFUSE", str(ROOT / "target/debug/posefuse"))


@pytest.fixture(scope="session", autouse=True)
def client(tmp_path_factory):
    """The folder with our Python package as its user has it after `pip install ./clients/python`; importable from here on."""
    folder = tmp_path_factory.mktemp("client")
    # Built from a copy, for building leaves things behind.
    shutil.copytree(CLIENT, folder / "source", ignore=shutil.ignore_patterns("__pycache__", "build", "*.egg-info"))
    install = ["install", "-q", "--no-deps", "--no-build-isolation", "--no-index", "--disable-pip-version-check"]
    subprocess.run([sys.executable, "-m", "pip", *install, "--target", folder / "site", folder / "source"], check=True)
    sys.path.insert(0, str(folder / "site"))
    return folder / "site"


@pytest.fixture(scope="session")
def recordings(tmp_path_factory):
    """The unpacked two-Kinect recordings, or a skip that says so."""
    data = pathlib.Path(os.environ.get("POSEFUSE_DATA", ROOT.parent / "shared/data"))
    archive = data / "kinectv2_dual.tar.bz2"
    if not archive.exists():
        pytest.skip(f"SKIPPED: no real recordings ({archive} is absent; set POSEFUSE_DATA)")
    folder = tmp_path_factory.mktemp("kinectv2_dual")
    with tarfile.open(archive) as tar:
        tar.extractall(folder, filter="data")
    return {path.name: path for path in folder.rglob("*.csv")}


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Program:
    """One running `posefuse` process; its output goes to a file that is shown when something fails."""

    def __init__(self, folder: pathlib.Path, name: str, *arguments):
        self.log = folder / f"{name}.log"
        self.name = name
        self.process = subprocess.Popen(
            [POSEFUSE, *map(str, arguments)],
            stdin=subprocess.DEVNULL,
            stdout=self.log.open("w"),
            stderr=subprocess.STDOUT,
        )

    def stop(self) -> int:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise AssertionError(f"{self.name} did not end within 20 s of Ctrl-C:\n{self.log.read_text()}") from None


class Room:
    """A server with a folder of its own, and whatever agents a test adds."""

    def __init__(self, folder: pathlib.Path):
        self.folder = folder
        self.takes = folder / "takes"
        self.takes.mkdir()
        self.address = f"127.0.0.1:{free_port()}"
        self.url = f"http://{self.address}"
        self.programs = []
        self.start("server", "server", "--listen", self.address, "--takes", self.takes,
                   "--calibration", folder / "calibration.toml")
        self.wait_for(self.reachable, "the server to answer")

    def start(self, name: str, *arguments) -> Program:
        program = Program(self.folder, name, *arguments)
        self.programs.append(program)
        return program

    def run(self, *arguments, code=0, timeout=180) -> str:
        """A command that ends by itself; returns its standard output."""
        done = subprocess.run(
            [POSEFUSE, *map(str, arguments)], capture_output=True, text=True, timeout=timeout, stdin=subprocess.DEVNULL
        )
        assert code is None or done.returncode == code, f"posefuse {arguments} gave {done.returncode}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    def stub(self):
        import grpc
        from posefuse.v1 import room_pb2_grpc

        channel = grpc.insecure_channel(self.address)
        return contextlib.closing(channel), room_pb2_grpc.RoomStub(channel)

    def status(self):
        from posefuse.v1 import room_pb2

        channel, stub = self.stub()
        with channel:
            return stub.GetStatus(room_pb2.GetStatusRequest(), timeout=5)

    def reachable(self) -> bool:
        import grpc

        try:
            return bool(self.status().server_version)
        except grpc.RpcError:
            return False

    def wait_for(self, condition, what: str, seconds: float = 30):
        deadline = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > deadline:
                logs = "\n".join(f"--- {p.name}\n{p.log.read_text()[-3000:]}" for p in self.programs)
                raise AssertionError(f"waited {seconds} s for {what} in vain\n{logs}")
            time.sleep(0.1)

    def take_info(self, name: str) -> dict:
        return json.loads(self.run("takes", "show", name, "--takes", self.takes, "--json"))

    def close(self):
        for program in reversed(self.programs):
            program.stop()


@pytest.fixture
def room(tmp_path):
    room = Room(tmp_path)
    yield room
    room.close()
