from posefuse.v1 import types_pb2 as _types_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class SensorState(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    SENSOR_STATE_UNSPECIFIED: _ClassVar[SensorState]
    SENSOR_STATE_LIVE: _ClassVar[SensorState]
    SENSOR_STATE_STALLED: _ClassVar[SensorState]
    SENSOR_STATE_DISCONNECTED: _ClassVar[SensorState]

class SinkState(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    SINK_STATE_UNSPECIFIED: _ClassVar[SinkState]
    SINK_STATE_OFF: _ClassVar[SinkState]
    SINK_STATE_RUNNING: _ClassVar[SinkState]
    SINK_STATE_FAILING: _ClassVar[SinkState]

class TakeState(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    TAKE_STATE_UNSPECIFIED: _ClassVar[TakeState]
    TAKE_STATE_RECORDING: _ClassVar[TakeState]
    TAKE_STATE_COMPLETE: _ClassVar[TakeState]
    TAKE_STATE_RECOVERED: _ClassVar[TakeState]
    TAKE_STATE_DAMAGED: _ClassVar[TakeState]

class Verdict(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    VERDICT_UNSPECIFIED: _ClassVar[Verdict]
    VERDICT_PASSED: _ClassVar[Verdict]
    VERDICT_WEAK: _ClassVar[Verdict]
    VERDICT_FAILED: _ClassVar[Verdict]

class CalibrationFormat(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    CALIBRATION_FORMAT_UNSPECIFIED: _ClassVar[CalibrationFormat]
    CALIBRATION_FORMAT_TOML: _ClassVar[CalibrationFormat]
    CALIBRATION_FORMAT_JSON: _ClassVar[CalibrationFormat]
    CALIBRATION_FORMAT_TF2_YAML: _ClassVar[CalibrationFormat]
    CALIBRATION_FORMAT_OPENCV_YAML: _ClassVar[CalibrationFormat]
SENSOR_STATE_UNSPECIFIED: SensorState
SENSOR_STATE_LIVE: SensorState
SENSOR_STATE_STALLED: SensorState
SENSOR_STATE_DISCONNECTED: SensorState
SINK_STATE_UNSPECIFIED: SinkState
SINK_STATE_OFF: SinkState
SINK_STATE_RUNNING: SinkState
SINK_STATE_FAILING: SinkState
TAKE_STATE_UNSPECIFIED: TakeState
TAKE_STATE_RECORDING: TakeState
TAKE_STATE_COMPLETE: TakeState
TAKE_STATE_RECOVERED: TakeState
TAKE_STATE_DAMAGED: TakeState
VERDICT_UNSPECIFIED: Verdict
VERDICT_PASSED: Verdict
VERDICT_WEAK: Verdict
VERDICT_FAILED: Verdict
CALIBRATION_FORMAT_UNSPECIFIED: CalibrationFormat
CALIBRATION_FORMAT_TOML: CalibrationFormat
CALIBRATION_FORMAT_JSON: CalibrationFormat
CALIBRATION_FORMAT_TF2_YAML: CalibrationFormat
CALIBRATION_FORMAT_OPENCV_YAML: CalibrationFormat

class WatchRequest(_message.Message):
    __slots__ = ("max_rate_hz",)
    MAX_RATE_HZ_FIELD_NUMBER: _ClassVar[int]
    max_rate_hz: float
    def __init__(self, max_rate_hz: _Optional[float] = ...) -> None: ...

class WatchSensorsRequest(_message.Message):
    __slots__ = ("sensors", "max_rate_hz")
    SENSORS_FIELD_NUMBER: _ClassVar[int]
    MAX_RATE_HZ_FIELD_NUMBER: _ClassVar[int]
    sensors: _containers.RepeatedScalarFieldContainer[str]
    max_rate_hz: float
    def __init__(self, sensors: _Optional[_Iterable[str]] = ..., max_rate_hz: _Optional[float] = ...) -> None: ...

class WatchDepthRequest(_message.Message):
    __slots__ = ("sensor", "max_rate_hz", "more_sensors")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    MAX_RATE_HZ_FIELD_NUMBER: _ClassVar[int]
    MORE_SENSORS_FIELD_NUMBER: _ClassVar[int]
    sensor: str
    max_rate_hz: float
    more_sensors: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, sensor: _Optional[str] = ..., max_rate_hz: _Optional[float] = ..., more_sensors: _Optional[_Iterable[str]] = ...) -> None: ...

class WatchStatusRequest(_message.Message):
    __slots__ = ("max_rate_hz",)
    MAX_RATE_HZ_FIELD_NUMBER: _ClassVar[int]
    max_rate_hz: float
    def __init__(self, max_rate_hz: _Optional[float] = ...) -> None: ...

class GetStatusRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class SensorStatus(_message.Message):
    __slots__ = ("info", "state", "calibrated", "room_from_sensor", "fov_horizontal_deg", "fov_vertical_deg", "frames_per_second", "latency_ms", "clock_offset_ms", "clock_error_ms", "clock_drift_ppm", "frames_received", "frames_lost", "rejected", "bodies", "residual_mm", "trouble", "agent_version", "agent_dropped", "muted", "drift", "contribution", "near_m", "far_m", "depth_preview")
    class RejectedEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: int
        def __init__(self, key: _Optional[str] = ..., value: _Optional[int] = ...) -> None: ...
    INFO_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    CALIBRATED_FIELD_NUMBER: _ClassVar[int]
    ROOM_FROM_SENSOR_FIELD_NUMBER: _ClassVar[int]
    FOV_HORIZONTAL_DEG_FIELD_NUMBER: _ClassVar[int]
    FOV_VERTICAL_DEG_FIELD_NUMBER: _ClassVar[int]
    FRAMES_PER_SECOND_FIELD_NUMBER: _ClassVar[int]
    LATENCY_MS_FIELD_NUMBER: _ClassVar[int]
    CLOCK_OFFSET_MS_FIELD_NUMBER: _ClassVar[int]
    CLOCK_ERROR_MS_FIELD_NUMBER: _ClassVar[int]
    CLOCK_DRIFT_PPM_FIELD_NUMBER: _ClassVar[int]
    FRAMES_RECEIVED_FIELD_NUMBER: _ClassVar[int]
    FRAMES_LOST_FIELD_NUMBER: _ClassVar[int]
    REJECTED_FIELD_NUMBER: _ClassVar[int]
    BODIES_FIELD_NUMBER: _ClassVar[int]
    RESIDUAL_MM_FIELD_NUMBER: _ClassVar[int]
    TROUBLE_FIELD_NUMBER: _ClassVar[int]
    AGENT_VERSION_FIELD_NUMBER: _ClassVar[int]
    AGENT_DROPPED_FIELD_NUMBER: _ClassVar[int]
    MUTED_FIELD_NUMBER: _ClassVar[int]
    DRIFT_FIELD_NUMBER: _ClassVar[int]
    CONTRIBUTION_FIELD_NUMBER: _ClassVar[int]
    NEAR_M_FIELD_NUMBER: _ClassVar[int]
    FAR_M_FIELD_NUMBER: _ClassVar[int]
    DEPTH_PREVIEW_FIELD_NUMBER: _ClassVar[int]
    info: _types_pb2.SensorInfo
    state: SensorState
    calibrated: bool
    room_from_sensor: _types_pb2.Pose
    fov_horizontal_deg: float
    fov_vertical_deg: float
    frames_per_second: float
    latency_ms: float
    clock_offset_ms: float
    clock_error_ms: float
    clock_drift_ppm: float
    frames_received: int
    frames_lost: int
    rejected: _containers.ScalarMap[str, int]
    bodies: int
    residual_mm: float
    trouble: str
    agent_version: str
    agent_dropped: int
    muted: bool
    drift: Drift
    contribution: Contribution
    near_m: float
    far_m: float
    depth_preview: bool
    def __init__(self, info: _Optional[_Union[_types_pb2.SensorInfo, _Mapping]] = ..., state: _Optional[_Union[SensorState, str]] = ..., calibrated: bool = ..., room_from_sensor: _Optional[_Union[_types_pb2.Pose, _Mapping]] = ..., fov_horizontal_deg: _Optional[float] = ..., fov_vertical_deg: _Optional[float] = ..., frames_per_second: _Optional[float] = ..., latency_ms: _Optional[float] = ..., clock_offset_ms: _Optional[float] = ..., clock_error_ms: _Optional[float] = ..., clock_drift_ppm: _Optional[float] = ..., frames_received: _Optional[int] = ..., frames_lost: _Optional[int] = ..., rejected: _Optional[_Mapping[str, int]] = ..., bodies: _Optional[int] = ..., residual_mm: _Optional[float] = ..., trouble: _Optional[str] = ..., agent_version: _Optional[str] = ..., agent_dropped: _Optional[int] = ..., muted: bool = ..., drift: _Optional[_Union[Drift, _Mapping]] = ..., contribution: _Optional[_Union[Contribution, _Mapping]] = ..., near_m: _Optional[float] = ..., far_m: _Optional[float] = ..., depth_preview: bool = ...) -> None: ...

class Drift(_message.Message):
    __slots__ = ("residual_mm", "usual_mm", "moved_mm", "moved_deg", "moved_sigma_mm", "moved_sigma_deg", "alarm")
    RESIDUAL_MM_FIELD_NUMBER: _ClassVar[int]
    USUAL_MM_FIELD_NUMBER: _ClassVar[int]
    MOVED_MM_FIELD_NUMBER: _ClassVar[int]
    MOVED_DEG_FIELD_NUMBER: _ClassVar[int]
    MOVED_SIGMA_MM_FIELD_NUMBER: _ClassVar[int]
    MOVED_SIGMA_DEG_FIELD_NUMBER: _ClassVar[int]
    ALARM_FIELD_NUMBER: _ClassVar[int]
    residual_mm: float
    usual_mm: float
    moved_mm: float
    moved_deg: float
    moved_sigma_mm: float
    moved_sigma_deg: float
    alarm: bool
    def __init__(self, residual_mm: _Optional[float] = ..., usual_mm: _Optional[float] = ..., moved_mm: _Optional[float] = ..., moved_deg: _Optional[float] = ..., moved_sigma_mm: _Optional[float] = ..., moved_sigma_deg: _Optional[float] = ..., alarm: bool = ...) -> None: ...

class Contribution(_message.Message):
    __slots__ = ("weight", "rejected_share", "residual_mm", "joint_weights", "joint_rejected_shares", "joint_residuals_mm")
    WEIGHT_FIELD_NUMBER: _ClassVar[int]
    REJECTED_SHARE_FIELD_NUMBER: _ClassVar[int]
    RESIDUAL_MM_FIELD_NUMBER: _ClassVar[int]
    JOINT_WEIGHTS_FIELD_NUMBER: _ClassVar[int]
    JOINT_REJECTED_SHARES_FIELD_NUMBER: _ClassVar[int]
    JOINT_RESIDUALS_MM_FIELD_NUMBER: _ClassVar[int]
    weight: float
    rejected_share: float
    residual_mm: float
    joint_weights: _containers.RepeatedScalarFieldContainer[float]
    joint_rejected_shares: _containers.RepeatedScalarFieldContainer[float]
    joint_residuals_mm: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, weight: _Optional[float] = ..., rejected_share: _Optional[float] = ..., residual_mm: _Optional[float] = ..., joint_weights: _Optional[_Iterable[float]] = ..., joint_rejected_shares: _Optional[_Iterable[float]] = ..., joint_residuals_mm: _Optional[_Iterable[float]] = ...) -> None: ...

class RoomStatus(_message.Message):
    __slots__ = ("time_ns", "unix_offset_ns", "server_version", "sensors", "people", "frames_per_second", "engine_us", "latency_p50_ms", "latency_p99_ms", "recording", "calibration", "calibrating", "disk_free_bytes", "troubles", "sinks", "take_folder", "repair", "timecode", "timecode_rate", "timecode_utc_offset_s", "triggers")
    TIME_NS_FIELD_NUMBER: _ClassVar[int]
    UNIX_OFFSET_NS_FIELD_NUMBER: _ClassVar[int]
    SERVER_VERSION_FIELD_NUMBER: _ClassVar[int]
    SENSORS_FIELD_NUMBER: _ClassVar[int]
    PEOPLE_FIELD_NUMBER: _ClassVar[int]
    FRAMES_PER_SECOND_FIELD_NUMBER: _ClassVar[int]
    ENGINE_US_FIELD_NUMBER: _ClassVar[int]
    LATENCY_P50_MS_FIELD_NUMBER: _ClassVar[int]
    LATENCY_P99_MS_FIELD_NUMBER: _ClassVar[int]
    RECORDING_FIELD_NUMBER: _ClassVar[int]
    CALIBRATION_FIELD_NUMBER: _ClassVar[int]
    CALIBRATING_FIELD_NUMBER: _ClassVar[int]
    DISK_FREE_BYTES_FIELD_NUMBER: _ClassVar[int]
    TROUBLES_FIELD_NUMBER: _ClassVar[int]
    SINKS_FIELD_NUMBER: _ClassVar[int]
    TAKE_FOLDER_FIELD_NUMBER: _ClassVar[int]
    REPAIR_FIELD_NUMBER: _ClassVar[int]
    TIMECODE_FIELD_NUMBER: _ClassVar[int]
    TIMECODE_RATE_FIELD_NUMBER: _ClassVar[int]
    TIMECODE_UTC_OFFSET_S_FIELD_NUMBER: _ClassVar[int]
    TRIGGERS_FIELD_NUMBER: _ClassVar[int]
    time_ns: int
    unix_offset_ns: int
    server_version: str
    sensors: _containers.RepeatedCompositeFieldContainer[SensorStatus]
    people: int
    frames_per_second: float
    engine_us: float
    latency_p50_ms: float
    latency_p99_ms: float
    recording: Take
    calibration: _types_pb2.Calibration
    calibrating: bool
    disk_free_bytes: int
    troubles: _containers.RepeatedScalarFieldContainer[str]
    sinks: _containers.RepeatedCompositeFieldContainer[SinkStatus]
    take_folder: str
    repair: RepairStatus
    timecode: str
    timecode_rate: str
    timecode_utc_offset_s: int
    triggers: _containers.RepeatedCompositeFieldContainer[TriggerStatus]
    def __init__(self, time_ns: _Optional[int] = ..., unix_offset_ns: _Optional[int] = ..., server_version: _Optional[str] = ..., sensors: _Optional[_Iterable[_Union[SensorStatus, _Mapping]]] = ..., people: _Optional[int] = ..., frames_per_second: _Optional[float] = ..., engine_us: _Optional[float] = ..., latency_p50_ms: _Optional[float] = ..., latency_p99_ms: _Optional[float] = ..., recording: _Optional[_Union[Take, _Mapping]] = ..., calibration: _Optional[_Union[_types_pb2.Calibration, _Mapping]] = ..., calibrating: bool = ..., disk_free_bytes: _Optional[int] = ..., troubles: _Optional[_Iterable[str]] = ..., sinks: _Optional[_Iterable[_Union[SinkStatus, _Mapping]]] = ..., take_folder: _Optional[str] = ..., repair: _Optional[_Union[RepairStatus, _Mapping]] = ..., timecode: _Optional[str] = ..., timecode_rate: _Optional[str] = ..., timecode_utc_offset_s: _Optional[int] = ..., triggers: _Optional[_Iterable[_Union[TriggerStatus, _Mapping]]] = ...) -> None: ...

class TriggerStatus(_message.Message):
    __slots__ = ("name", "place", "trouble", "done", "refused", "latest", "latest_refused", "latest_unix_ns")
    NAME_FIELD_NUMBER: _ClassVar[int]
    PLACE_FIELD_NUMBER: _ClassVar[int]
    TROUBLE_FIELD_NUMBER: _ClassVar[int]
    DONE_FIELD_NUMBER: _ClassVar[int]
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    LATEST_FIELD_NUMBER: _ClassVar[int]
    LATEST_REFUSED_FIELD_NUMBER: _ClassVar[int]
    LATEST_UNIX_NS_FIELD_NUMBER: _ClassVar[int]
    name: str
    place: str
    trouble: str
    done: int
    refused: int
    latest: str
    latest_refused: bool
    latest_unix_ns: int
    def __init__(self, name: _Optional[str] = ..., place: _Optional[str] = ..., trouble: _Optional[str] = ..., done: _Optional[int] = ..., refused: _Optional[int] = ..., latest: _Optional[str] = ..., latest_refused: bool = ..., latest_unix_ns: _Optional[int] = ...) -> None: ...

class RepairStatus(_message.Message):
    __slots__ = ("model", "runtime", "requests", "answers", "late", "failed", "p50_ms", "p99_ms", "trouble")
    MODEL_FIELD_NUMBER: _ClassVar[int]
    RUNTIME_FIELD_NUMBER: _ClassVar[int]
    REQUESTS_FIELD_NUMBER: _ClassVar[int]
    ANSWERS_FIELD_NUMBER: _ClassVar[int]
    LATE_FIELD_NUMBER: _ClassVar[int]
    FAILED_FIELD_NUMBER: _ClassVar[int]
    P50_MS_FIELD_NUMBER: _ClassVar[int]
    P99_MS_FIELD_NUMBER: _ClassVar[int]
    TROUBLE_FIELD_NUMBER: _ClassVar[int]
    model: str
    runtime: str
    requests: int
    answers: int
    late: int
    failed: int
    p50_ms: float
    p99_ms: float
    trouble: str
    def __init__(self, model: _Optional[str] = ..., runtime: _Optional[str] = ..., requests: _Optional[int] = ..., answers: _Optional[int] = ..., late: _Optional[int] = ..., failed: _Optional[int] = ..., p50_ms: _Optional[float] = ..., p99_ms: _Optional[float] = ..., trouble: _Optional[str] = ...) -> None: ...

class SinkStatus(_message.Message):
    __slots__ = ("name", "delivered", "dropped", "state", "place", "rate_hz", "clients", "p50_ms", "p99_ms", "trouble")
    NAME_FIELD_NUMBER: _ClassVar[int]
    DELIVERED_FIELD_NUMBER: _ClassVar[int]
    DROPPED_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    PLACE_FIELD_NUMBER: _ClassVar[int]
    RATE_HZ_FIELD_NUMBER: _ClassVar[int]
    CLIENTS_FIELD_NUMBER: _ClassVar[int]
    P50_MS_FIELD_NUMBER: _ClassVar[int]
    P99_MS_FIELD_NUMBER: _ClassVar[int]
    TROUBLE_FIELD_NUMBER: _ClassVar[int]
    name: str
    delivered: int
    dropped: int
    state: SinkState
    place: str
    rate_hz: float
    clients: int
    p50_ms: float
    p99_ms: float
    trouble: str
    def __init__(self, name: _Optional[str] = ..., delivered: _Optional[int] = ..., dropped: _Optional[int] = ..., state: _Optional[_Union[SinkState, str]] = ..., place: _Optional[str] = ..., rate_hz: _Optional[float] = ..., clients: _Optional[int] = ..., p50_ms: _Optional[float] = ..., p99_ms: _Optional[float] = ..., trouble: _Optional[str] = ...) -> None: ...

class SwitchSinkRequest(_message.Message):
    __slots__ = ("name", "on")
    NAME_FIELD_NUMBER: _ClassVar[int]
    ON_FIELD_NUMBER: _ClassVar[int]
    name: str
    on: bool
    def __init__(self, name: _Optional[str] = ..., on: bool = ...) -> None: ...

class Take(_message.Message):
    __slots__ = ("name", "slate", "notes", "state", "started", "duration_ns", "size_bytes", "frames", "people", "sensors", "dropped", "trouble", "start_unix_ns", "timecode", "timecode_rate")
    NAME_FIELD_NUMBER: _ClassVar[int]
    SLATE_FIELD_NUMBER: _ClassVar[int]
    NOTES_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    STARTED_FIELD_NUMBER: _ClassVar[int]
    DURATION_NS_FIELD_NUMBER: _ClassVar[int]
    SIZE_BYTES_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    PEOPLE_FIELD_NUMBER: _ClassVar[int]
    SENSORS_FIELD_NUMBER: _ClassVar[int]
    DROPPED_FIELD_NUMBER: _ClassVar[int]
    TROUBLE_FIELD_NUMBER: _ClassVar[int]
    START_UNIX_NS_FIELD_NUMBER: _ClassVar[int]
    TIMECODE_FIELD_NUMBER: _ClassVar[int]
    TIMECODE_RATE_FIELD_NUMBER: _ClassVar[int]
    name: str
    slate: str
    notes: str
    state: TakeState
    started: str
    duration_ns: int
    size_bytes: int
    frames: int
    people: int
    sensors: _containers.RepeatedScalarFieldContainer[str]
    dropped: int
    trouble: str
    start_unix_ns: int
    timecode: str
    timecode_rate: str
    def __init__(self, name: _Optional[str] = ..., slate: _Optional[str] = ..., notes: _Optional[str] = ..., state: _Optional[_Union[TakeState, str]] = ..., started: _Optional[str] = ..., duration_ns: _Optional[int] = ..., size_bytes: _Optional[int] = ..., frames: _Optional[int] = ..., people: _Optional[int] = ..., sensors: _Optional[_Iterable[str]] = ..., dropped: _Optional[int] = ..., trouble: _Optional[str] = ..., start_unix_ns: _Optional[int] = ..., timecode: _Optional[str] = ..., timecode_rate: _Optional[str] = ...) -> None: ...

class StartTakeRequest(_message.Message):
    __slots__ = ("name", "slate", "notes")
    NAME_FIELD_NUMBER: _ClassVar[int]
    SLATE_FIELD_NUMBER: _ClassVar[int]
    NOTES_FIELD_NUMBER: _ClassVar[int]
    name: str
    slate: str
    notes: str
    def __init__(self, name: _Optional[str] = ..., slate: _Optional[str] = ..., notes: _Optional[str] = ...) -> None: ...

class StopTakeRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class ListTakesRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class ListTakesResponse(_message.Message):
    __slots__ = ("takes",)
    TAKES_FIELD_NUMBER: _ClassVar[int]
    takes: _containers.RepeatedCompositeFieldContainer[Take]
    def __init__(self, takes: _Optional[_Iterable[_Union[Take, _Mapping]]] = ...) -> None: ...

class UpdateTakeRequest(_message.Message):
    __slots__ = ("name", "slate", "notes")
    NAME_FIELD_NUMBER: _ClassVar[int]
    SLATE_FIELD_NUMBER: _ClassVar[int]
    NOTES_FIELD_NUMBER: _ClassVar[int]
    name: str
    slate: str
    notes: str
    def __init__(self, name: _Optional[str] = ..., slate: _Optional[str] = ..., notes: _Optional[str] = ...) -> None: ...

class ReplayTakeRequest(_message.Message):
    __slots__ = ("name", "start_ns", "speed")
    NAME_FIELD_NUMBER: _ClassVar[int]
    START_NS_FIELD_NUMBER: _ClassVar[int]
    SPEED_FIELD_NUMBER: _ClassVar[int]
    name: str
    start_ns: int
    speed: float
    def __init__(self, name: _Optional[str] = ..., start_ns: _Optional[int] = ..., speed: _Optional[float] = ...) -> None: ...

class ReplayEvent(_message.Message):
    __slots__ = ("offset_ns", "start", "frame", "observation")
    OFFSET_NS_FIELD_NUMBER: _ClassVar[int]
    START_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    OBSERVATION_FIELD_NUMBER: _ClassVar[int]
    offset_ns: int
    start: ReplayStart
    frame: _types_pb2.RoomFrame
    observation: _types_pb2.Observation
    def __init__(self, offset_ns: _Optional[int] = ..., start: _Optional[_Union[ReplayStart, _Mapping]] = ..., frame: _Optional[_Union[_types_pb2.RoomFrame, _Mapping]] = ..., observation: _Optional[_Union[_types_pb2.Observation, _Mapping]] = ...) -> None: ...

class ReplayStart(_message.Message):
    __slots__ = ("take", "sensors", "calibration")
    TAKE_FIELD_NUMBER: _ClassVar[int]
    SENSORS_FIELD_NUMBER: _ClassVar[int]
    CALIBRATION_FIELD_NUMBER: _ClassVar[int]
    take: Take
    sensors: _containers.RepeatedCompositeFieldContainer[_types_pb2.SensorInfo]
    calibration: _types_pb2.Calibration
    def __init__(self, take: _Optional[_Union[Take, _Mapping]] = ..., sensors: _Optional[_Iterable[_Union[_types_pb2.SensorInfo, _Mapping]]] = ..., calibration: _Optional[_Union[_types_pb2.Calibration, _Mapping]] = ...) -> None: ...

class CalibrateRequest(_message.Message):
    __slots__ = ("seconds", "dry_run")
    SECONDS_FIELD_NUMBER: _ClassVar[int]
    DRY_RUN_FIELD_NUMBER: _ClassVar[int]
    seconds: float
    dry_run: bool
    def __init__(self, seconds: _Optional[float] = ..., dry_run: bool = ...) -> None: ...

class CalibrateEvent(_message.Message):
    __slots__ = ("progress", "result")
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    RESULT_FIELD_NUMBER: _ClassVar[int]
    progress: CalibrateProgress
    result: CalibrateResult
    def __init__(self, progress: _Optional[_Union[CalibrateProgress, _Mapping]] = ..., result: _Optional[_Union[CalibrateResult, _Mapping]] = ...) -> None: ...

class CalibrateProgress(_message.Message):
    __slots__ = ("elapsed_seconds", "total_seconds", "sensors", "share", "hint", "solving")
    ELAPSED_SECONDS_FIELD_NUMBER: _ClassVar[int]
    TOTAL_SECONDS_FIELD_NUMBER: _ClassVar[int]
    SENSORS_FIELD_NUMBER: _ClassVar[int]
    SHARE_FIELD_NUMBER: _ClassVar[int]
    HINT_FIELD_NUMBER: _ClassVar[int]
    SOLVING_FIELD_NUMBER: _ClassVar[int]
    elapsed_seconds: float
    total_seconds: float
    sensors: _containers.RepeatedCompositeFieldContainer[SensorProgress]
    share: float
    hint: str
    solving: bool
    def __init__(self, elapsed_seconds: _Optional[float] = ..., total_seconds: _Optional[float] = ..., sensors: _Optional[_Iterable[_Union[SensorProgress, _Mapping]]] = ..., share: _Optional[float] = ..., hint: _Optional[str] = ..., solving: bool = ...) -> None: ...

class SensorProgress(_message.Message):
    __slots__ = ("sensor", "frames", "cells", "shared", "share", "covered")
    class SharedEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: int
        def __init__(self, key: _Optional[str] = ..., value: _Optional[int] = ...) -> None: ...
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    CELLS_FIELD_NUMBER: _ClassVar[int]
    SHARED_FIELD_NUMBER: _ClassVar[int]
    SHARE_FIELD_NUMBER: _ClassVar[int]
    COVERED_FIELD_NUMBER: _ClassVar[int]
    sensor: str
    frames: int
    cells: int
    shared: _containers.ScalarMap[str, int]
    share: float
    covered: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, sensor: _Optional[str] = ..., frames: _Optional[int] = ..., cells: _Optional[int] = ..., shared: _Optional[_Mapping[str, int]] = ..., share: _Optional[float] = ..., covered: _Optional[_Iterable[int]] = ...) -> None: ...

class CalibrateResult(_message.Message):
    __slots__ = ("verdict", "reasons", "calibration", "in_force", "pairs", "sensors", "ray_bias_mm")
    VERDICT_FIELD_NUMBER: _ClassVar[int]
    REASONS_FIELD_NUMBER: _ClassVar[int]
    CALIBRATION_FIELD_NUMBER: _ClassVar[int]
    IN_FORCE_FIELD_NUMBER: _ClassVar[int]
    PAIRS_FIELD_NUMBER: _ClassVar[int]
    SENSORS_FIELD_NUMBER: _ClassVar[int]
    RAY_BIAS_MM_FIELD_NUMBER: _ClassVar[int]
    verdict: Verdict
    reasons: _containers.RepeatedScalarFieldContainer[str]
    calibration: _types_pb2.Calibration
    in_force: bool
    pairs: _containers.RepeatedCompositeFieldContainer[PairResidual]
    sensors: _containers.RepeatedCompositeFieldContainer[SensorResult]
    ray_bias_mm: float
    def __init__(self, verdict: _Optional[_Union[Verdict, str]] = ..., reasons: _Optional[_Iterable[str]] = ..., calibration: _Optional[_Union[_types_pb2.Calibration, _Mapping]] = ..., in_force: bool = ..., pairs: _Optional[_Iterable[_Union[PairResidual, _Mapping]]] = ..., sensors: _Optional[_Iterable[_Union[SensorResult, _Mapping]]] = ..., ray_bias_mm: _Optional[float] = ...) -> None: ...

class SensorResult(_message.Message):
    __slots__ = ("sensor", "median_m", "p95_m", "samples", "time_offset_ms", "clock_drift_ppm", "bone_scale", "sigma")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    MEDIAN_M_FIELD_NUMBER: _ClassVar[int]
    P95_M_FIELD_NUMBER: _ClassVar[int]
    SAMPLES_FIELD_NUMBER: _ClassVar[int]
    TIME_OFFSET_MS_FIELD_NUMBER: _ClassVar[int]
    CLOCK_DRIFT_PPM_FIELD_NUMBER: _ClassVar[int]
    BONE_SCALE_FIELD_NUMBER: _ClassVar[int]
    SIGMA_FIELD_NUMBER: _ClassVar[int]
    sensor: str
    median_m: float
    p95_m: float
    samples: int
    time_offset_ms: float
    clock_drift_ppm: float
    bone_scale: float
    sigma: _types_pb2.PoseSigma
    def __init__(self, sensor: _Optional[str] = ..., median_m: _Optional[float] = ..., p95_m: _Optional[float] = ..., samples: _Optional[int] = ..., time_offset_ms: _Optional[float] = ..., clock_drift_ppm: _Optional[float] = ..., bone_scale: _Optional[float] = ..., sigma: _Optional[_Union[_types_pb2.PoseSigma, _Mapping]] = ...) -> None: ...

class PairResidual(_message.Message):
    __slots__ = ("a", "b", "before_rms_m", "after_median_m", "after_p95_m", "samples", "before_median_m", "agreeing_share", "mirrored_share", "weakest")
    A_FIELD_NUMBER: _ClassVar[int]
    B_FIELD_NUMBER: _ClassVar[int]
    BEFORE_RMS_M_FIELD_NUMBER: _ClassVar[int]
    AFTER_MEDIAN_M_FIELD_NUMBER: _ClassVar[int]
    AFTER_P95_M_FIELD_NUMBER: _ClassVar[int]
    SAMPLES_FIELD_NUMBER: _ClassVar[int]
    BEFORE_MEDIAN_M_FIELD_NUMBER: _ClassVar[int]
    AGREEING_SHARE_FIELD_NUMBER: _ClassVar[int]
    MIRRORED_SHARE_FIELD_NUMBER: _ClassVar[int]
    WEAKEST_FIELD_NUMBER: _ClassVar[int]
    a: str
    b: str
    before_rms_m: float
    after_median_m: float
    after_p95_m: float
    samples: int
    before_median_m: float
    agreeing_share: float
    mirrored_share: float
    weakest: bool
    def __init__(self, a: _Optional[str] = ..., b: _Optional[str] = ..., before_rms_m: _Optional[float] = ..., after_median_m: _Optional[float] = ..., after_p95_m: _Optional[float] = ..., samples: _Optional[int] = ..., before_median_m: _Optional[float] = ..., agreeing_share: _Optional[float] = ..., mirrored_share: _Optional[float] = ..., weakest: bool = ...) -> None: ...

class GetCalibrationRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class SetCalibrationRequest(_message.Message):
    __slots__ = ("calibration",)
    CALIBRATION_FIELD_NUMBER: _ClassVar[int]
    calibration: _types_pb2.Calibration
    def __init__(self, calibration: _Optional[_Union[_types_pb2.Calibration, _Mapping]] = ...) -> None: ...

class ListCalibrationsRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class ListCalibrationsResponse(_message.Message):
    __slots__ = ("calibrations",)
    CALIBRATIONS_FIELD_NUMBER: _ClassVar[int]
    calibrations: _containers.RepeatedCompositeFieldContainer[StoredCalibration]
    def __init__(self, calibrations: _Optional[_Iterable[_Union[StoredCalibration, _Mapping]]] = ...) -> None: ...

class StoredCalibration(_message.Message):
    __slots__ = ("name", "in_force", "calibration", "trouble")
    NAME_FIELD_NUMBER: _ClassVar[int]
    IN_FORCE_FIELD_NUMBER: _ClassVar[int]
    CALIBRATION_FIELD_NUMBER: _ClassVar[int]
    TROUBLE_FIELD_NUMBER: _ClassVar[int]
    name: str
    in_force: bool
    calibration: _types_pb2.Calibration
    trouble: str
    def __init__(self, name: _Optional[str] = ..., in_force: bool = ..., calibration: _Optional[_Union[_types_pb2.Calibration, _Mapping]] = ..., trouble: _Optional[str] = ...) -> None: ...

class RestoreCalibrationRequest(_message.Message):
    __slots__ = ("name",)
    NAME_FIELD_NUMBER: _ClassVar[int]
    name: str
    def __init__(self, name: _Optional[str] = ...) -> None: ...

class CompareCalibrationsRequest(_message.Message):
    __slots__ = ("before", "after")
    BEFORE_FIELD_NUMBER: _ClassVar[int]
    AFTER_FIELD_NUMBER: _ClassVar[int]
    before: str
    after: str
    def __init__(self, before: _Optional[str] = ..., after: _Optional[str] = ...) -> None: ...

class CompareCalibrationsResponse(_message.Message):
    __slots__ = ("moves",)
    MOVES_FIELD_NUMBER: _ClassVar[int]
    moves: _containers.RepeatedCompositeFieldContainer[SensorMove]
    def __init__(self, moves: _Optional[_Iterable[_Union[SensorMove, _Mapping]]] = ...) -> None: ...

class SensorMove(_message.Message):
    __slots__ = ("sensor", "moved_mm", "moved_deg", "moved_ms", "missing_in")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    MOVED_MM_FIELD_NUMBER: _ClassVar[int]
    MOVED_DEG_FIELD_NUMBER: _ClassVar[int]
    MOVED_MS_FIELD_NUMBER: _ClassVar[int]
    MISSING_IN_FIELD_NUMBER: _ClassVar[int]
    sensor: str
    moved_mm: float
    moved_deg: float
    moved_ms: float
    missing_in: str
    def __init__(self, sensor: _Optional[str] = ..., moved_mm: _Optional[float] = ..., moved_deg: _Optional[float] = ..., moved_ms: _Optional[float] = ..., missing_in: _Optional[str] = ...) -> None: ...

class ExportCalibrationRequest(_message.Message):
    __slots__ = ("name", "format")
    NAME_FIELD_NUMBER: _ClassVar[int]
    FORMAT_FIELD_NUMBER: _ClassVar[int]
    name: str
    format: CalibrationFormat
    def __init__(self, name: _Optional[str] = ..., format: _Optional[_Union[CalibrationFormat, str]] = ...) -> None: ...

class CalibrationFile(_message.Message):
    __slots__ = ("file_name", "text")
    FILE_NAME_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    file_name: str
    text: str
    def __init__(self, file_name: _Optional[str] = ..., text: _Optional[str] = ...) -> None: ...

class ImportCalibrationRequest(_message.Message):
    __slots__ = ("text", "format", "dry_run")
    TEXT_FIELD_NUMBER: _ClassVar[int]
    FORMAT_FIELD_NUMBER: _ClassVar[int]
    DRY_RUN_FIELD_NUMBER: _ClassVar[int]
    text: str
    format: CalibrationFormat
    dry_run: bool
    def __init__(self, text: _Optional[str] = ..., format: _Optional[_Union[CalibrationFormat, str]] = ..., dry_run: bool = ...) -> None: ...

class RecalibrateSensorRequest(_message.Message):
    __slots__ = ("sensor", "dry_run")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    DRY_RUN_FIELD_NUMBER: _ClassVar[int]
    sensor: str
    dry_run: bool
    def __init__(self, sensor: _Optional[str] = ..., dry_run: bool = ...) -> None: ...

class MuteSensorRequest(_message.Message):
    __slots__ = ("sensor", "muted")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    MUTED_FIELD_NUMBER: _ClassVar[int]
    sensor: str
    muted: bool
    def __init__(self, sensor: _Optional[str] = ..., muted: bool = ...) -> None: ...

class MuteSensorResponse(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class PlanRoomRequest(_message.Message):
    __slots__ = ("planned", "planned_only", "area", "suggest_model", "place")
    PLANNED_FIELD_NUMBER: _ClassVar[int]
    PLANNED_ONLY_FIELD_NUMBER: _ClassVar[int]
    AREA_FIELD_NUMBER: _ClassVar[int]
    SUGGEST_MODEL_FIELD_NUMBER: _ClassVar[int]
    PLACE_FIELD_NUMBER: _ClassVar[int]
    planned: _containers.RepeatedCompositeFieldContainer[PlannedSensor]
    planned_only: bool
    area: PlanArea
    suggest_model: str
    place: int
    def __init__(self, planned: _Optional[_Iterable[_Union[PlannedSensor, _Mapping]]] = ..., planned_only: bool = ..., area: _Optional[_Union[PlanArea, _Mapping]] = ..., suggest_model: _Optional[str] = ..., place: _Optional[int] = ...) -> None: ...

class PlannedSensor(_message.Message):
    __slots__ = ("name", "model", "position", "looks_at")
    NAME_FIELD_NUMBER: _ClassVar[int]
    MODEL_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    LOOKS_AT_FIELD_NUMBER: _ClassVar[int]
    name: str
    model: str
    position: _types_pb2.Vector3
    looks_at: _types_pb2.Vector3
    def __init__(self, name: _Optional[str] = ..., model: _Optional[str] = ..., position: _Optional[_Union[_types_pb2.Vector3, _Mapping]] = ..., looks_at: _Optional[_Union[_types_pb2.Vector3, _Mapping]] = ...) -> None: ...

class PlanArea(_message.Message):
    __slots__ = ("min_x", "max_x", "min_y", "max_y")
    MIN_X_FIELD_NUMBER: _ClassVar[int]
    MAX_X_FIELD_NUMBER: _ClassVar[int]
    MIN_Y_FIELD_NUMBER: _ClassVar[int]
    MAX_Y_FIELD_NUMBER: _ClassVar[int]
    min_x: float
    max_x: float
    min_y: float
    max_y: float
    def __init__(self, min_x: _Optional[float] = ..., max_x: _Optional[float] = ..., min_y: _Optional[float] = ..., max_y: _Optional[float] = ...) -> None: ...

class RoomPlan(_message.Message):
    __slots__ = ("area", "cell_m", "columns", "rows", "layers", "whole", "sensors", "interferences", "suggestion", "notes", "models", "crossed_share")
    AREA_FIELD_NUMBER: _ClassVar[int]
    CELL_M_FIELD_NUMBER: _ClassVar[int]
    COLUMNS_FIELD_NUMBER: _ClassVar[int]
    ROWS_FIELD_NUMBER: _ClassVar[int]
    LAYERS_FIELD_NUMBER: _ClassVar[int]
    WHOLE_FIELD_NUMBER: _ClassVar[int]
    SENSORS_FIELD_NUMBER: _ClassVar[int]
    INTERFERENCES_FIELD_NUMBER: _ClassVar[int]
    SUGGESTION_FIELD_NUMBER: _ClassVar[int]
    NOTES_FIELD_NUMBER: _ClassVar[int]
    MODELS_FIELD_NUMBER: _ClassVar[int]
    CROSSED_SHARE_FIELD_NUMBER: _ClassVar[int]
    area: PlanArea
    cell_m: float
    columns: int
    rows: int
    layers: _containers.RepeatedCompositeFieldContainer[PlanLayer]
    whole: PlanLayer
    sensors: _containers.RepeatedCompositeFieldContainer[PlanSensor]
    interferences: _containers.RepeatedCompositeFieldContainer[Interference]
    suggestion: Suggestion
    notes: _containers.RepeatedScalarFieldContainer[str]
    models: _containers.RepeatedScalarFieldContainer[str]
    crossed_share: float
    def __init__(self, area: _Optional[_Union[PlanArea, _Mapping]] = ..., cell_m: _Optional[float] = ..., columns: _Optional[int] = ..., rows: _Optional[int] = ..., layers: _Optional[_Iterable[_Union[PlanLayer, _Mapping]]] = ..., whole: _Optional[_Union[PlanLayer, _Mapping]] = ..., sensors: _Optional[_Iterable[_Union[PlanSensor, _Mapping]]] = ..., interferences: _Optional[_Iterable[_Union[Interference, _Mapping]]] = ..., suggestion: _Optional[_Union[Suggestion, _Mapping]] = ..., notes: _Optional[_Iterable[str]] = ..., models: _Optional[_Iterable[str]] = ..., crossed_share: _Optional[float] = ...) -> None: ...

class PlanLayer(_message.Message):
    __slots__ = ("height_m", "counts", "shares")
    HEIGHT_M_FIELD_NUMBER: _ClassVar[int]
    COUNTS_FIELD_NUMBER: _ClassVar[int]
    SHARES_FIELD_NUMBER: _ClassVar[int]
    height_m: float
    counts: bytes
    shares: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, height_m: _Optional[float] = ..., counts: _Optional[bytes] = ..., shares: _Optional[_Iterable[float]] = ...) -> None: ...

class PlanSensor(_message.Message):
    __slots__ = ("name", "model", "planned", "room_from_sensor", "fov_horizontal_deg", "fov_vertical_deg", "near_m", "far_m", "light", "assumed")
    NAME_FIELD_NUMBER: _ClassVar[int]
    MODEL_FIELD_NUMBER: _ClassVar[int]
    PLANNED_FIELD_NUMBER: _ClassVar[int]
    ROOM_FROM_SENSOR_FIELD_NUMBER: _ClassVar[int]
    FOV_HORIZONTAL_DEG_FIELD_NUMBER: _ClassVar[int]
    FOV_VERTICAL_DEG_FIELD_NUMBER: _ClassVar[int]
    NEAR_M_FIELD_NUMBER: _ClassVar[int]
    FAR_M_FIELD_NUMBER: _ClassVar[int]
    LIGHT_FIELD_NUMBER: _ClassVar[int]
    ASSUMED_FIELD_NUMBER: _ClassVar[int]
    name: str
    model: str
    planned: bool
    room_from_sensor: _types_pb2.Pose
    fov_horizontal_deg: float
    fov_vertical_deg: float
    near_m: float
    far_m: float
    light: str
    assumed: bool
    def __init__(self, name: _Optional[str] = ..., model: _Optional[str] = ..., planned: bool = ..., room_from_sensor: _Optional[_Union[_types_pb2.Pose, _Mapping]] = ..., fov_horizontal_deg: _Optional[float] = ..., fov_vertical_deg: _Optional[float] = ..., near_m: _Optional[float] = ..., far_m: _Optional[float] = ..., light: _Optional[str] = ..., assumed: bool = ...) -> None: ...

class Interference(_message.Message):
    __slots__ = ("a", "b", "share_of_a", "share_of_b", "facing", "severity", "advice")
    A_FIELD_NUMBER: _ClassVar[int]
    B_FIELD_NUMBER: _ClassVar[int]
    SHARE_OF_A_FIELD_NUMBER: _ClassVar[int]
    SHARE_OF_B_FIELD_NUMBER: _ClassVar[int]
    FACING_FIELD_NUMBER: _ClassVar[int]
    SEVERITY_FIELD_NUMBER: _ClassVar[int]
    ADVICE_FIELD_NUMBER: _ClassVar[int]
    a: str
    b: str
    share_of_a: float
    share_of_b: float
    facing: bool
    severity: str
    advice: str
    def __init__(self, a: _Optional[str] = ..., b: _Optional[str] = ..., share_of_a: _Optional[float] = ..., share_of_b: _Optional[float] = ..., facing: bool = ..., severity: _Optional[str] = ..., advice: _Optional[str] = ...) -> None: ...

class Suggestion(_message.Message):
    __slots__ = ("sensor", "looks_at", "one_before", "one_after", "two_before", "two_after", "words", "crossed_before", "crossed_after")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    LOOKS_AT_FIELD_NUMBER: _ClassVar[int]
    ONE_BEFORE_FIELD_NUMBER: _ClassVar[int]
    ONE_AFTER_FIELD_NUMBER: _ClassVar[int]
    TWO_BEFORE_FIELD_NUMBER: _ClassVar[int]
    TWO_AFTER_FIELD_NUMBER: _ClassVar[int]
    WORDS_FIELD_NUMBER: _ClassVar[int]
    CROSSED_BEFORE_FIELD_NUMBER: _ClassVar[int]
    CROSSED_AFTER_FIELD_NUMBER: _ClassVar[int]
    sensor: PlanSensor
    looks_at: _types_pb2.Vector3
    one_before: float
    one_after: float
    two_before: float
    two_after: float
    words: str
    crossed_before: float
    crossed_after: float
    def __init__(self, sensor: _Optional[_Union[PlanSensor, _Mapping]] = ..., looks_at: _Optional[_Union[_types_pb2.Vector3, _Mapping]] = ..., one_before: _Optional[float] = ..., one_after: _Optional[float] = ..., two_before: _Optional[float] = ..., two_after: _Optional[float] = ..., words: _Optional[str] = ..., crossed_before: _Optional[float] = ..., crossed_after: _Optional[float] = ...) -> None: ...

class GetConfigRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class GetConfigResponse(_message.Message):
    __slots__ = ("toml",)
    TOML_FIELD_NUMBER: _ClassVar[int]
    toml: str
    def __init__(self, toml: _Optional[str] = ...) -> None: ...
