from posefuse.v1 import types_pb2 as _types_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class AgentMessage(_message.Message):
    __slots__ = ("hello", "frame", "clock_echo", "health", "preview")
    HELLO_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    CLOCK_ECHO_FIELD_NUMBER: _ClassVar[int]
    HEALTH_FIELD_NUMBER: _ClassVar[int]
    PREVIEW_FIELD_NUMBER: _ClassVar[int]
    hello: Hello
    frame: Frame
    clock_echo: ClockEcho
    health: Health
    preview: _types_pb2.DepthPreview
    def __init__(self, hello: _Optional[_Union[Hello, _Mapping]] = ..., frame: _Optional[_Union[Frame, _Mapping]] = ..., clock_echo: _Optional[_Union[ClockEcho, _Mapping]] = ..., health: _Optional[_Union[Health, _Mapping]] = ..., preview: _Optional[_Union[_types_pb2.DepthPreview, _Mapping]] = ...) -> None: ...

class ServerMessage(_message.Message):
    __slots__ = ("welcome", "clock_probe", "command", "ack")
    WELCOME_FIELD_NUMBER: _ClassVar[int]
    CLOCK_PROBE_FIELD_NUMBER: _ClassVar[int]
    COMMAND_FIELD_NUMBER: _ClassVar[int]
    ACK_FIELD_NUMBER: _ClassVar[int]
    welcome: Welcome
    clock_probe: ClockProbe
    command: Command
    ack: Ack
    def __init__(self, welcome: _Optional[_Union[Welcome, _Mapping]] = ..., clock_probe: _Optional[_Union[ClockProbe, _Mapping]] = ..., command: _Optional[_Union[Command, _Mapping]] = ..., ack: _Optional[_Union[Ack, _Mapping]] = ...) -> None: ...

class Hello(_message.Message):
    __slots__ = ("sensor", "model", "joint_set", "protocol", "agent_version", "run_id", "camera")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    MODEL_FIELD_NUMBER: _ClassVar[int]
    JOINT_SET_FIELD_NUMBER: _ClassVar[int]
    PROTOCOL_FIELD_NUMBER: _ClassVar[int]
    AGENT_VERSION_FIELD_NUMBER: _ClassVar[int]
    RUN_ID_FIELD_NUMBER: _ClassVar[int]
    CAMERA_FIELD_NUMBER: _ClassVar[int]
    sensor: str
    model: str
    joint_set: str
    protocol: int
    agent_version: str
    run_id: int
    camera: CameraInfo
    def __init__(self, sensor: _Optional[str] = ..., model: _Optional[str] = ..., joint_set: _Optional[str] = ..., protocol: _Optional[int] = ..., agent_version: _Optional[str] = ..., run_id: _Optional[int] = ..., camera: _Optional[_Union[CameraInfo, _Mapping]] = ...) -> None: ...

class CameraInfo(_message.Message):
    __slots__ = ("fov_horizontal_deg", "fov_vertical_deg", "near_m", "far_m", "depth_preview")
    FOV_HORIZONTAL_DEG_FIELD_NUMBER: _ClassVar[int]
    FOV_VERTICAL_DEG_FIELD_NUMBER: _ClassVar[int]
    NEAR_M_FIELD_NUMBER: _ClassVar[int]
    FAR_M_FIELD_NUMBER: _ClassVar[int]
    DEPTH_PREVIEW_FIELD_NUMBER: _ClassVar[int]
    fov_horizontal_deg: float
    fov_vertical_deg: float
    near_m: float
    far_m: float
    depth_preview: bool
    def __init__(self, fov_horizontal_deg: _Optional[float] = ..., fov_vertical_deg: _Optional[float] = ..., near_m: _Optional[float] = ..., far_m: _Optional[float] = ..., depth_preview: bool = ...) -> None: ...

class Frame(_message.Message):
    __slots__ = ("sequence", "captured_ns", "bodies")
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    CAPTURED_NS_FIELD_NUMBER: _ClassVar[int]
    BODIES_FIELD_NUMBER: _ClassVar[int]
    sequence: int
    captured_ns: int
    bodies: _containers.RepeatedCompositeFieldContainer[_types_pb2.Body]
    def __init__(self, sequence: _Optional[int] = ..., captured_ns: _Optional[int] = ..., bodies: _Optional[_Iterable[_Union[_types_pb2.Body, _Mapping]]] = ...) -> None: ...

class ClockEcho(_message.Message):
    __slots__ = ("probe", "agent_received_ns", "agent_sent_ns")
    PROBE_FIELD_NUMBER: _ClassVar[int]
    AGENT_RECEIVED_NS_FIELD_NUMBER: _ClassVar[int]
    AGENT_SENT_NS_FIELD_NUMBER: _ClassVar[int]
    probe: int
    agent_received_ns: int
    agent_sent_ns: int
    def __init__(self, probe: _Optional[int] = ..., agent_received_ns: _Optional[int] = ..., agent_sent_ns: _Optional[int] = ...) -> None: ...

class Health(_message.Message):
    __slots__ = ("frames_per_second", "frames_dropped", "frames_buffered", "trouble", "connections")
    FRAMES_PER_SECOND_FIELD_NUMBER: _ClassVar[int]
    FRAMES_DROPPED_FIELD_NUMBER: _ClassVar[int]
    FRAMES_BUFFERED_FIELD_NUMBER: _ClassVar[int]
    TROUBLE_FIELD_NUMBER: _ClassVar[int]
    CONNECTIONS_FIELD_NUMBER: _ClassVar[int]
    frames_per_second: float
    frames_dropped: int
    frames_buffered: int
    trouble: str
    connections: int
    def __init__(self, frames_per_second: _Optional[float] = ..., frames_dropped: _Optional[int] = ..., frames_buffered: _Optional[int] = ..., trouble: _Optional[str] = ..., connections: _Optional[int] = ...) -> None: ...

class Welcome(_message.Message):
    __slots__ = ("sensor_id", "server_version", "last_sequence")
    SENSOR_ID_FIELD_NUMBER: _ClassVar[int]
    SERVER_VERSION_FIELD_NUMBER: _ClassVar[int]
    LAST_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    sensor_id: int
    server_version: str
    last_sequence: int
    def __init__(self, sensor_id: _Optional[int] = ..., server_version: _Optional[str] = ..., last_sequence: _Optional[int] = ...) -> None: ...

class ClockProbe(_message.Message):
    __slots__ = ("probe",)
    PROBE_FIELD_NUMBER: _ClassVar[int]
    probe: int
    def __init__(self, probe: _Optional[int] = ...) -> None: ...

class Ack(_message.Message):
    __slots__ = ("sequence",)
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    sequence: int
    def __init__(self, sequence: _Optional[int] = ...) -> None: ...

class Command(_message.Message):
    __slots__ = ("stop", "preview")
    STOP_FIELD_NUMBER: _ClassVar[int]
    PREVIEW_FIELD_NUMBER: _ClassVar[int]
    stop: str
    preview: PreviewRequest
    def __init__(self, stop: _Optional[str] = ..., preview: _Optional[_Union[PreviewRequest, _Mapping]] = ...) -> None: ...

class PreviewRequest(_message.Message):
    __slots__ = ("max_rate_hz",)
    MAX_RATE_HZ_FIELD_NUMBER: _ClassVar[int]
    max_rate_hz: float
    def __init__(self, max_rate_hz: _Optional[float] = ...) -> None: ...
