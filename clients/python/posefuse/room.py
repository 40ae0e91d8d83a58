"""The room's server from the outside: fused people, raw skeletons, state, takes, calibration."""
from __future__ import annotations

import contextlib
import types
from collections.abc import Callable, Generator, Iterator
from typing import Any, TypeVar

import grpc

from ._channel import open_channel, parse_server
from .calibration import (
    Calibration,
    CalibrationProgress,
    CalibrationResult,
    StoredCalibration,
    calibration_of,
    format_of,
    progress_of,
    result_of,
    stored_of,
)
from .errors import ServerError
from .people import RoomFrame, SensorFrame, frame_of, sensor_frame_of
from .takes import Take, take_of
from .v1 import room_pb2, room_pb2_grpc

_Item = TypeVar("_Item")
#: How long a call may take that asks for nothing that takes time.
_SOON_S = 10.0


class Room:
    """One room, by its server.

        with posefuse.Room() as room:
            for frame in room.watch():
                print(frame.people)

    Every method raises `ServerError` where the server does not answer or refuses; its words say what to do, and `code` is
    gRPC's, e.g. `NOT_FOUND`.
    """

    def __init__(self, server: str | None = None) -> None:
        """server: host and port; without one POSEFUSE_SERVER or this machine."""
        self.server = parse_server(server)
        self._channel = open_channel(self.server)
        #: Everything else that a room can do: the generated stub of `proto/posefuse/v1/room.proto`.
        self.stub = room_pb2_grpc.RoomStub(self._channel)

    # --- as it happens ------------------------------------------------------------------------------------------

    def watch(self, max_rate_hz: float = 0.0, seconds: float | None = None) -> Generator[RoomFrame, None, None]:
        """Fused people as they come, for so many seconds or for ever; 0: every frame. An empty room gives few or none."""
        request = room_pb2.WatchRequest(max_rate_hz=max_rate_hz)
        return self._stream(self.stub.Watch, request, frame_of, seconds)

    def watch_sensors(
        self, *sensors: str, max_rate_hz: float = 0.0, seconds: float | None = None
    ) -> Generator[SensorFrame, None, None]:
        """Raw skeletons of these sensors (all, if none is named) as they come, for so many seconds or for ever."""
        request = room_pb2.WatchSensorsRequest(sensors=sensors, max_rate_hz=max_rate_hz)
        return self._stream(self.stub.WatchSensors, request, sensor_frame_of, seconds)

    def status(self, timeout_s: float = 5.0) -> room_pb2.RoomStatus:
        """The state of sensors, takes and calibration."""
        status: room_pb2.RoomStatus = self._ask(self.stub.GetStatus, room_pb2.GetStatusRequest(), timeout_s)
        return status

    def watch_status(self, max_rate_hz: float = 0.0, seconds: float | None = None) -> Generator[room_pb2.RoomStatus, None, None]:
        """The state now, and then at each change, at least once a second."""
        request = room_pb2.WatchStatusRequest(max_rate_hz=max_rate_hz)
        return self._stream(self.stub.WatchStatus, request, lambda status: status, seconds)

    def mute(self, sensor: str, muted: bool = True) -> None:
        """Leaves a sensor out of fusing, or takes it in again. It is still recorded."""
        self._ask(self.stub.MuteSensor, room_pb2.MuteSensorRequest(sensor=sensor, muted=muted))

    def switch_output(self, name: str, on: bool) -> room_pb2.SinkStatus:
        """Switches a live output (`osc`, `vmc` ...; `status().sinks` has them) on or off until the server ends."""
        status: room_pb2.SinkStatus = self._ask(self.stub.SwitchSink, room_pb2.SwitchSinkRequest(name=name, on=on))
        return status

    # --- takes --------------------------------------------------------------------------------------------------

    def takes(self) -> list[Take]:
        """All takes of the server."""
        return [take_of(take) for take in self._ask(self.stub.ListTakes, room_pb2.ListTakesRequest()).takes]

    def take(self, name: str) -> Take:
        """The take of this name. Raises `ServerError` (NOT_FOUND) where there is none."""
        found = next((take for take in self.takes() if take.name == name), None)
        if found is None:
            raise ServerError(f"{self.server}: no take is called {name!r}; `room.takes()` has them all", "NOT_FOUND")
        return found

    def start_take(self, name: str = "", slate: str = "", notes: str = "") -> Take:
        """Begins to record. Without a name the take has date and time as its name; a name that exists gets a number appended."""
        return take_of(self._ask(self.stub.StartTake, room_pb2.StartTakeRequest(name=name, slate=slate, notes=notes)))

    def stop_take(self) -> Take:
        """Ends the recording, and gives the take when it is whole on the disk."""
        return take_of(self._ask(self.stub.StopTake, room_pb2.StopTakeRequest(), 60.0))

    @contextlib.contextmanager
    def recording(self, name: str = "", slate: str = "", notes: str = "") -> Iterator[Take]:
        """Records while its block runs, also if that ends by an exception.

            with room.recording("walk") as take:
                time.sleep(10)
            print(room.take_path(take.name))
        """
        take = self.start_take(name, slate, notes)
        try:
            yield take
        finally:
            # Somebody else may have stopped it, and begun another.
            if self.take(take.name).state == "recording":
                self.stop_take()

    def describe_take(self, name: str, slate: str | None = None, notes: str | None = None) -> Take:
        """Changes what is written on a take; None leaves it as it is."""
        return take_of(self._ask(self.stub.UpdateTake, room_pb2.UpdateTakeRequest(name=name, slate=slate, notes=notes)))

    def take_path(self, name: str) -> str:
        """The take's file on the server's computer: what `posefuse export` and `posefuse takes show` take."""
        take = self.take(name)
        folder = self.status().take_folder
        separator = "\\" if "\\" in folder and "/" not in folder else "/"
        return f"{folder.rstrip(separator)}{separator}{take.name}.mcap"

    def replay(self, name: str, start_s: float = 0.0, speed: float = 0.0) -> Generator[RoomFrame, None, None]:
        """The fused frames of a take from `start_s` on. speed: 1 is real time, 0 as fast as they are read."""
        request = room_pb2.ReplayTakeRequest(name=name, start_ns=round(start_s * 1e9), speed=speed)
        with contextlib.closing(self._stream(self.stub.ReplayTake, request, lambda event: event)) as events:
            yield from (frame_of(event.frame) for event in events if event.HasField("frame"))

    # --- calibration --------------------------------------------------------------------------------------------

    def calibrate(
        self,
        seconds: float = 0.0,
        *,
        dry_run: bool = False,
        on_progress: Callable[[CalibrationProgress], object] | None = None,
    ) -> CalibrationResult:
        """Finds out where the sensors stand while one person walks about, and puts it in force unless it failed.

        seconds: how long; 0: until enough has been seen, 120 s at most. dry_run: only report. An exception of `on_progress`
        calls the calibration off.
        """
        request = room_pb2.CalibrateRequest(seconds=seconds, dry_run=dry_run)
        with contextlib.closing(self._stream(self.stub.Calibrate, request, lambda event: event)) as events:
            for event in events:
                if event.HasField("result"):
                    return result_of(event.result)
                if event.HasField("progress") and on_progress is not None:
                    on_progress(progress_of(event.progress))
        raise ServerError(f"{self.server}: the calibration was called off", "CANCELLED")

    def calibration(self) -> Calibration:
        """The one in force. Raises `ServerError` (NOT_FOUND) where there is none."""
        return calibration_of(self._ask(self.stub.GetCalibration, room_pb2.GetCalibrationRequest()))

    def calibrations(self) -> list[StoredCalibration]:
        """Those that the server keeps, the newest first."""
        kept = self._ask(self.stub.ListCalibrations, room_pb2.ListCalibrationsRequest()).calibrations
        return [stored_of(calibration) for calibration in kept]

    def restore_calibration(self, name: str) -> Calibration:
        """Puts a kept calibration in force."""
        return calibration_of(self._ask(self.stub.RestoreCalibration, room_pb2.RestoreCalibrationRequest(name=name)))

    def export_calibration(self, form: str = "toml", name: str = "") -> str:
        """A calibration (the one in force, if none is named) as text of a form: toml, json, tf2-yaml or opencv-yaml."""
        request = room_pb2.ExportCalibrationRequest(name=name, format=format_of(form))
        text: str = self._ask(self.stub.ExportCalibration, request).text
        return text

    def import_calibration(self, text: str, *, dry_run: bool = False) -> Calibration:
        """Reads a calibration of any of these forms and puts it in force; dry_run: only reads and checks it."""
        request = room_pb2.ImportCalibrationRequest(text=text, dry_run=dry_run)
        return calibration_of(self._ask(self.stub.ImportCalibration, request))

    def recalibrate_sensor(self, sensor: str, *, dry_run: bool = False) -> CalibrationResult:
        """Finds one sensor's place anew from what all sensors saw of late; the others stay where they are."""
        request = room_pb2.RecalibrateSensorRequest(sensor=sensor, dry_run=dry_run)
        return result_of(self._ask(self.stub.RecalibrateSensor, request, 60.0))

    # --- the connection -----------------------------------------------------------------------------------------

    def close(self) -> None:
        """Ends every stream."""
        self._channel.close()

    def __enter__(self) -> Room:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        self.close()

    def _ask(self, method: Callable[..., Any], request: Any, timeout_s: float = _SOON_S) -> Any:
        try:
            return method(request, timeout=timeout_s)
        except grpc.RpcError as error:
            raise self._failed(error) from None

    def _stream(
        self, method: Callable[..., Any], request: Any, shape: Callable[[Any], _Item], seconds: float | None = None
    ) -> Generator[_Item, None, None]:
        """What a call streams, each message in our own shape; closing this ends the call."""
        call, heard = method(request, timeout=seconds), False
        try:
            for message in call:
                heard = True
                yield shape(message)
        except grpc.RpcError as error:
            over = seconds is not None and call.code() is grpc.StatusCode.DEADLINE_EXCEEDED
            if not over and call.code() is not grpc.StatusCode.CANCELLED:
                raise self._failed(error) from None
            if over and not heard:
                # A room without people looks the same as a machine that is not there.
                self.status(1.0)
        finally:
            call.cancel()

    def _failed(self, error: grpc.RpcError) -> ServerError:
        code = error.code()
        if code in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED):
            words = f"nothing answers at {self.server}; is `posefuse server` running there? ({error.details()})"
        else:
            words = f"{self.server}: {error.details()}"
        return ServerError(words, code.name)
