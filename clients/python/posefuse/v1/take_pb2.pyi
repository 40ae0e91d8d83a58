from posefuse.v1 import types_pb2 as _types_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class EngineInput(_message.Message):
    __slots__ = ("sensor", "observation", "clock_sample", "calibration", "tick_ns", "state", "mute", "repair_model", "repaired")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    OBSERVATION_FIELD_NUMBER: _ClassVar[int]
    CLOCK_SAMPLE_FIELD_NUMBER: _ClassVar[int]
    CALIBRATION_FIELD_NUMBER: _ClassVar[int]
    TICK_NS_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    MUTE_FIELD_NUMBER: _ClassVar[int]
    REPAIR_MODEL_FIELD_NUMBER: _ClassVar[int]
    REPAIRED_FIELD_NUMBER: _ClassVar[int]
    sensor: _types_pb2.SensorInfo
    observation: _types_pb2.Observation
    clock_sample: _types_pb2.ClockSample
    calibration: _types_pb2.Calibration
    tick_ns: int
    state: EngineState
    mute: SensorMute
    repair_model: RepairModel
    repaired: RepairAnswer
    def __init__(self, sensor: _Optional[_Union[_types_pb2.SensorInfo, _Mapping]] = ..., observation: _Optional[_Union[_types_pb2.Observation, _Mapping]] = ..., clock_sample: _Optional[_Union[_types_pb2.ClockSample, _Mapping]] = ..., calibration: _Optional[_Union[_types_pb2.Calibration, _Mapping]] = ..., tick_ns: _Optional[int] = ..., state: _Optional[_Union[EngineState, _Mapping]] = ..., mute: _Optional[_Union[SensorMute, _Mapping]] = ..., repair_model: _Optional[_Union[RepairModel, _Mapping]] = ..., repaired: _Optional[_Union[RepairAnswer, _Mapping]] = ...) -> None: ...

class SensorMute(_message.Message):
    __slots__ = ("sensor", "muted")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    MUTED_FIELD_NUMBER: _ClassVar[int]
    sensor: int
    muted: bool
    def __init__(self, sensor: _Optional[int] = ..., muted: bool = ...) -> None: ...

class RepairModel(_message.Message):
    __slots__ = ("name", "before", "after", "rate_hz")
    NAME_FIELD_NUMBER: _ClassVar[int]
    BEFORE_FIELD_NUMBER: _ClassVar[int]
    AFTER_FIELD_NUMBER: _ClassVar[int]
    RATE_HZ_FIELD_NUMBER: _ClassVar[int]
    name: str
    before: int
    after: int
    rate_hz: float
    def __init__(self, name: _Optional[str] = ..., before: _Optional[int] = ..., after: _Optional[int] = ..., rate_hz: _Optional[float] = ...) -> None: ...

class RepairAnswer(_message.Message):
    __slots__ = ("number", "received_ns", "fills")
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    RECEIVED_NS_FIELD_NUMBER: _ClassVar[int]
    FILLS_FIELD_NUMBER: _ClassVar[int]
    number: int
    received_ns: int
    fills: _containers.RepeatedCompositeFieldContainer[RepairFill]
    def __init__(self, number: _Optional[int] = ..., received_ns: _Optional[int] = ..., fills: _Optional[_Iterable[_Union[RepairFill, _Mapping]]] = ...) -> None: ...

class RepairFill(_message.Message):
    __slots__ = ("joints", "positions", "sigmas", "rotated", "rotations")
    JOINTS_FIELD_NUMBER: _ClassVar[int]
    POSITIONS_FIELD_NUMBER: _ClassVar[int]
    SIGMAS_FIELD_NUMBER: _ClassVar[int]
    ROTATED_FIELD_NUMBER: _ClassVar[int]
    ROTATIONS_FIELD_NUMBER: _ClassVar[int]
    joints: bytes
    positions: _containers.RepeatedScalarFieldContainer[float]
    sigmas: _containers.RepeatedScalarFieldContainer[float]
    rotated: bytes
    rotations: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, joints: _Optional[bytes] = ..., positions: _Optional[_Iterable[float]] = ..., sigmas: _Optional[_Iterable[float]] = ..., rotated: _Optional[bytes] = ..., rotations: _Optional[_Iterable[float]] = ...) -> None: ...

class EngineState(_message.Message):
    __slots__ = ("build", "state")
    BUILD_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    build: str
    state: bytes
    def __init__(self, build: _Optional[str] = ..., state: _Optional[bytes] = ...) -> None: ...

class Rejection(_message.Message):
    __slots__ = ("sensor", "time_ns", "reason", "joint")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    TIME_NS_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    JOINT_FIELD_NUMBER: _ClassVar[int]
    sensor: int
    time_ns: int
    reason: str
    joint: str
    def __init__(self, sensor: _Optional[int] = ..., time_ns: _Optional[int] = ..., reason: _Optional[str] = ..., joint: _Optional[str] = ...) -> None: ...

class Event(_message.Message):
    __slots__ = ("time_ns", "kind", "sensor", "text", "count")
    TIME_NS_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    COUNT_FIELD_NUMBER: _ClassVar[int]
    time_ns: int
    kind: str
    sensor: str
    text: str
    count: int
    def __init__(self, time_ns: _Optional[int] = ..., kind: _Optional[str] = ..., sensor: _Optional[str] = ..., text: _Optional[str] = ..., count: _Optional[int] = ...) -> None: ...

class Truth(_message.Message):
    __slots__ = ("time_ns", "people")
    TIME_NS_FIELD_NUMBER: _ClassVar[int]
    PEOPLE_FIELD_NUMBER: _ClassVar[int]
    time_ns: int
    people: _containers.RepeatedCompositeFieldContainer[TruePerson]
    def __init__(self, time_ns: _Optional[int] = ..., people: _Optional[_Iterable[_Union[TruePerson, _Mapping]]] = ...) -> None: ...

class TruePerson(_message.Message):
    __slots__ = ("id", "positions")
    ID_FIELD_NUMBER: _ClassVar[int]
    POSITIONS_FIELD_NUMBER: _ClassVar[int]
    id: int
    positions: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, id: _Optional[int] = ..., positions: _Optional[_Iterable[float]] = ...) -> None: ...
