from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Provenance(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    PROVENANCE_UNSPECIFIED: _ClassVar[Provenance]
    PROVENANCE_MISSING: _ClassVar[Provenance]
    PROVENANCE_MEASURED: _ClassVar[Provenance]
    PROVENANCE_PREDICTED: _ClassVar[Provenance]
    PROVENANCE_REPAIRED: _ClassVar[Provenance]
PROVENANCE_UNSPECIFIED: Provenance
PROVENANCE_MISSING: Provenance
PROVENANCE_MEASURED: Provenance
PROVENANCE_PREDICTED: Provenance
PROVENANCE_REPAIRED: Provenance

class Vector3(_message.Message):
    __slots__ = ("x", "y", "z")
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    x: float
    y: float
    z: float
    def __init__(self, x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ...) -> None: ...

class Quaternion(_message.Message):
    __slots__ = ("x", "y", "z", "w")
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    W_FIELD_NUMBER: _ClassVar[int]
    x: float
    y: float
    z: float
    w: float
    def __init__(self, x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ..., w: _Optional[float] = ...) -> None: ...

class Pose(_message.Message):
    __slots__ = ("translation", "rotation")
    TRANSLATION_FIELD_NUMBER: _ClassVar[int]
    ROTATION_FIELD_NUMBER: _ClassVar[int]
    translation: Vector3
    rotation: Quaternion
    def __init__(self, translation: _Optional[_Union[Vector3, _Mapping]] = ..., rotation: _Optional[_Union[Quaternion, _Mapping]] = ...) -> None: ...

class Body(_message.Message):
    __slots__ = ("tracking_id", "positions", "confidences", "orientations", "hands_closed")
    TRACKING_ID_FIELD_NUMBER: _ClassVar[int]
    POSITIONS_FIELD_NUMBER: _ClassVar[int]
    CONFIDENCES_FIELD_NUMBER: _ClassVar[int]
    ORIENTATIONS_FIELD_NUMBER: _ClassVar[int]
    HANDS_CLOSED_FIELD_NUMBER: _ClassVar[int]
    tracking_id: int
    positions: _containers.RepeatedScalarFieldContainer[float]
    confidences: _containers.RepeatedScalarFieldContainer[float]
    orientations: _containers.RepeatedScalarFieldContainer[float]
    hands_closed: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, tracking_id: _Optional[int] = ..., positions: _Optional[_Iterable[float]] = ..., confidences: _Optional[_Iterable[float]] = ..., orientations: _Optional[_Iterable[float]] = ..., hands_closed: _Optional[_Iterable[float]] = ...) -> None: ...

class Intrinsics(_message.Message):
    __slots__ = ("fx", "fy", "cx", "cy")
    FX_FIELD_NUMBER: _ClassVar[int]
    FY_FIELD_NUMBER: _ClassVar[int]
    CX_FIELD_NUMBER: _ClassVar[int]
    CY_FIELD_NUMBER: _ClassVar[int]
    fx: float
    fy: float
    cx: float
    cy: float
    def __init__(self, fx: _Optional[float] = ..., fy: _Optional[float] = ..., cx: _Optional[float] = ..., cy: _Optional[float] = ...) -> None: ...

class DepthPreview(_message.Message):
    __slots__ = ("sensor", "captured_ns", "width", "height", "millimetres", "camera", "bodies")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    CAPTURED_NS_FIELD_NUMBER: _ClassVar[int]
    WIDTH_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_FIELD_NUMBER: _ClassVar[int]
    MILLIMETRES_FIELD_NUMBER: _ClassVar[int]
    CAMERA_FIELD_NUMBER: _ClassVar[int]
    BODIES_FIELD_NUMBER: _ClassVar[int]
    sensor: str
    captured_ns: int
    width: int
    height: int
    millimetres: bytes
    camera: Intrinsics
    bodies: _containers.RepeatedCompositeFieldContainer[Body]
    def __init__(self, sensor: _Optional[str] = ..., captured_ns: _Optional[int] = ..., width: _Optional[int] = ..., height: _Optional[int] = ..., millimetres: _Optional[bytes] = ..., camera: _Optional[_Union[Intrinsics, _Mapping]] = ..., bodies: _Optional[_Iterable[_Union[Body, _Mapping]]] = ...) -> None: ...

class Track(_message.Message):
    __slots__ = ("id", "since_ns", "sensors", "positions", "covariances", "confidences", "provenances", "joint_sensors", "hands_closed", "hands_sensors")
    ID_FIELD_NUMBER: _ClassVar[int]
    SINCE_NS_FIELD_NUMBER: _ClassVar[int]
    SENSORS_FIELD_NUMBER: _ClassVar[int]
    POSITIONS_FIELD_NUMBER: _ClassVar[int]
    COVARIANCES_FIELD_NUMBER: _ClassVar[int]
    CONFIDENCES_FIELD_NUMBER: _ClassVar[int]
    PROVENANCES_FIELD_NUMBER: _ClassVar[int]
    JOINT_SENSORS_FIELD_NUMBER: _ClassVar[int]
    HANDS_CLOSED_FIELD_NUMBER: _ClassVar[int]
    HANDS_SENSORS_FIELD_NUMBER: _ClassVar[int]
    id: int
    since_ns: int
    sensors: int
    positions: _containers.RepeatedScalarFieldContainer[float]
    covariances: _containers.RepeatedScalarFieldContainer[float]
    confidences: _containers.RepeatedScalarFieldContainer[float]
    provenances: _containers.RepeatedScalarFieldContainer[Provenance]
    joint_sensors: _containers.RepeatedScalarFieldContainer[int]
    hands_closed: _containers.RepeatedScalarFieldContainer[float]
    hands_sensors: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, id: _Optional[int] = ..., since_ns: _Optional[int] = ..., sensors: _Optional[int] = ..., positions: _Optional[_Iterable[float]] = ..., covariances: _Optional[_Iterable[float]] = ..., confidences: _Optional[_Iterable[float]] = ..., provenances: _Optional[_Iterable[_Union[Provenance, str]]] = ..., joint_sensors: _Optional[_Iterable[int]] = ..., hands_closed: _Optional[_Iterable[float]] = ..., hands_sensors: _Optional[_Iterable[int]] = ...) -> None: ...

class RoomFrame(_message.Message):
    __slots__ = ("number", "time_ns", "look_ahead_ns", "tracks", "unix_ns", "timecode")
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    TIME_NS_FIELD_NUMBER: _ClassVar[int]
    LOOK_AHEAD_NS_FIELD_NUMBER: _ClassVar[int]
    TRACKS_FIELD_NUMBER: _ClassVar[int]
    UNIX_NS_FIELD_NUMBER: _ClassVar[int]
    TIMECODE_FIELD_NUMBER: _ClassVar[int]
    number: int
    time_ns: int
    look_ahead_ns: int
    tracks: _containers.RepeatedCompositeFieldContainer[Track]
    unix_ns: int
    timecode: str
    def __init__(self, number: _Optional[int] = ..., time_ns: _Optional[int] = ..., look_ahead_ns: _Optional[int] = ..., tracks: _Optional[_Iterable[_Union[Track, _Mapping]]] = ..., unix_ns: _Optional[int] = ..., timecode: _Optional[str] = ...) -> None: ...

class SensorInfo(_message.Message):
    __slots__ = ("id", "name", "model", "joint_set")
    ID_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    MODEL_FIELD_NUMBER: _ClassVar[int]
    JOINT_SET_FIELD_NUMBER: _ClassVar[int]
    id: int
    name: str
    model: str
    joint_set: str
    def __init__(self, id: _Optional[int] = ..., name: _Optional[str] = ..., model: _Optional[str] = ..., joint_set: _Optional[str] = ...) -> None: ...

class Observation(_message.Message):
    __slots__ = ("sensor", "sequence", "captured_ns", "received_ns", "bodies")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    CAPTURED_NS_FIELD_NUMBER: _ClassVar[int]
    RECEIVED_NS_FIELD_NUMBER: _ClassVar[int]
    BODIES_FIELD_NUMBER: _ClassVar[int]
    sensor: int
    sequence: int
    captured_ns: int
    received_ns: int
    bodies: _containers.RepeatedCompositeFieldContainer[Body]
    def __init__(self, sensor: _Optional[int] = ..., sequence: _Optional[int] = ..., captured_ns: _Optional[int] = ..., received_ns: _Optional[int] = ..., bodies: _Optional[_Iterable[_Union[Body, _Mapping]]] = ...) -> None: ...

class ClockSample(_message.Message):
    __slots__ = ("sensor", "sent_ns", "returned_ns", "agent_received_ns", "agent_sent_ns")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    SENT_NS_FIELD_NUMBER: _ClassVar[int]
    RETURNED_NS_FIELD_NUMBER: _ClassVar[int]
    AGENT_RECEIVED_NS_FIELD_NUMBER: _ClassVar[int]
    AGENT_SENT_NS_FIELD_NUMBER: _ClassVar[int]
    sensor: int
    sent_ns: int
    returned_ns: int
    agent_received_ns: int
    agent_sent_ns: int
    def __init__(self, sensor: _Optional[int] = ..., sent_ns: _Optional[int] = ..., returned_ns: _Optional[int] = ..., agent_received_ns: _Optional[int] = ..., agent_sent_ns: _Optional[int] = ...) -> None: ...

class SensorPose(_message.Message):
    __slots__ = ("sensor", "room_from_sensor", "time_offset_ns", "residual_median_m", "residual_p95_m", "samples", "sigma")
    SENSOR_FIELD_NUMBER: _ClassVar[int]
    ROOM_FROM_SENSOR_FIELD_NUMBER: _ClassVar[int]
    TIME_OFFSET_NS_FIELD_NUMBER: _ClassVar[int]
    RESIDUAL_MEDIAN_M_FIELD_NUMBER: _ClassVar[int]
    RESIDUAL_P95_M_FIELD_NUMBER: _ClassVar[int]
    SAMPLES_FIELD_NUMBER: _ClassVar[int]
    SIGMA_FIELD_NUMBER: _ClassVar[int]
    sensor: str
    room_from_sensor: Pose
    time_offset_ns: int
    residual_median_m: float
    residual_p95_m: float
    samples: int
    sigma: PoseSigma
    def __init__(self, sensor: _Optional[str] = ..., room_from_sensor: _Optional[_Union[Pose, _Mapping]] = ..., time_offset_ns: _Optional[int] = ..., residual_median_m: _Optional[float] = ..., residual_p95_m: _Optional[float] = ..., samples: _Optional[int] = ..., sigma: _Optional[_Union[PoseSigma, _Mapping]] = ...) -> None: ...

class PoseSigma(_message.Message):
    __slots__ = ("position_m", "rotation_deg", "time_ms")
    POSITION_M_FIELD_NUMBER: _ClassVar[int]
    ROTATION_DEG_FIELD_NUMBER: _ClassVar[int]
    TIME_MS_FIELD_NUMBER: _ClassVar[int]
    position_m: float
    rotation_deg: float
    time_ms: float
    def __init__(self, position_m: _Optional[float] = ..., rotation_deg: _Optional[float] = ..., time_ms: _Optional[float] = ...) -> None: ...

class RayBias(_message.Message):
    __slots__ = ("joint", "metres")
    JOINT_FIELD_NUMBER: _ClassVar[int]
    METRES_FIELD_NUMBER: _ClassVar[int]
    joint: str
    metres: float
    def __init__(self, joint: _Optional[str] = ..., metres: _Optional[float] = ...) -> None: ...

class JointOffset(_message.Message):
    __slots__ = ("joint_set", "joint", "offset")
    JOINT_SET_FIELD_NUMBER: _ClassVar[int]
    JOINT_FIELD_NUMBER: _ClassVar[int]
    OFFSET_FIELD_NUMBER: _ClassVar[int]
    joint_set: str
    joint: str
    offset: Vector3
    def __init__(self, joint_set: _Optional[str] = ..., joint: _Optional[str] = ..., offset: _Optional[_Union[Vector3, _Mapping]] = ...) -> None: ...

class Calibration(_message.Message):
    __slots__ = ("created", "method", "floor", "sensors", "verdict", "ray_bias", "joint_offsets")
    CREATED_FIELD_NUMBER: _ClassVar[int]
    METHOD_FIELD_NUMBER: _ClassVar[int]
    FLOOR_FIELD_NUMBER: _ClassVar[int]
    SENSORS_FIELD_NUMBER: _ClassVar[int]
    VERDICT_FIELD_NUMBER: _ClassVar[int]
    RAY_BIAS_FIELD_NUMBER: _ClassVar[int]
    JOINT_OFFSETS_FIELD_NUMBER: _ClassVar[int]
    created: str
    method: str
    floor: str
    sensors: _containers.RepeatedCompositeFieldContainer[SensorPose]
    verdict: str
    ray_bias: _containers.RepeatedCompositeFieldContainer[RayBias]
    joint_offsets: _containers.RepeatedCompositeFieldContainer[JointOffset]
    def __init__(self, created: _Optional[str] = ..., method: _Optional[str] = ..., floor: _Optional[str] = ..., sensors: _Optional[_Iterable[_Union[SensorPose, _Mapping]]] = ..., verdict: _Optional[str] = ..., ray_bias: _Optional[_Iterable[_Union[RayBias, _Mapping]]] = ..., joint_offsets: _Optional[_Iterable[_Union[JointOffset, _Mapping]]] = ...) -> None: ...
