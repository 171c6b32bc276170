"""The core's messages: numpy structured data with words for codes.

The fields are those of fitmac.h, whose comments say what they mean.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _fitmac

_OBJECT = [
    ("id", "<u2"), ("grasp_class", "u1"), ("visible", "u1"), ("reserved", "<u4"),
    ("stamp_ns", "<u8"), ("position_m", "<f8", 3), ("orientation", "<f8", 4),
    ("half_extent_m", "<f8", 3), ("confidence", "<f8"),
]
_CANDIDATE = [("id", "<u2"), ("compatible", "u1"), ("reserved", "u1", 5), ("confidence", "<f8")]
_SENT = [("sequence", "<u8"), ("session", "<u8"), ("stamp_ns", "<u8")]

_FIELDS: dict[str, list[Any]] = {
    "ObjectSample": _OBJECT,
    "StateSample": [
        *_SENT, ("applied_command", "<u8"), ("joint_position_rad", "<f8", 7),
        ("joint_velocity_rad_s", "<f8", 7), ("ee_position_m", "<f8", 3),
        ("ee_orientation", "<f8", 4), ("ee_velocity_m_s", "<f8", 3), ("gripper_width_m", "<f8"),
        ("object_count", "<u4"), ("reserved", "<u4"), ("objects", _OBJECT, 32),
    ],
    "ActionChunk": [
        ("sequence", "<u8"), ("session", "<u8"), ("observation_ns", "<u8"), ("stamp_ns", "<u8"),
        ("query_id", "<u8"), ("epoch", "<u8"), ("subtask", "<u4"), ("prompt_id", "<u4"),
        ("horizon", "<u4"), ("action_space", "u1"), ("frame", "u1"), ("gripper", "u1"),
        ("reserved", "u1"), ("actions", "<f4", (64, 7)),
    ],
    "GroundingRecord": [
        *_SENT, ("epoch", "<u8"), ("subtask", "<u4"), ("prompt_id", "<u4"), ("target", "<u2"),
        ("destination", "<u2"), ("destination_kind", "u1"), ("relation", "u1"),
        ("provenance", "u1"), ("candidate_count", "u1"), ("confidence", "<f8"),
        ("region_offset_m", "<f8", 3), ("region_half_extent_m", "<f8", 3),
        ("image_box_px", "<f4", 4), ("candidates", _CANDIDATE, 16),
    ],
    "Plan": [("id", "<u8"), ("subtask_count", "<u4"), ("confidence_permille", "<u4")],
    "VerifierReport": [
        ("sequence", "<u8"), ("stamp_ns", "<u8"), ("subtask", "<u4"), ("verdict", "u1"),
        ("reserved", "u1", 3),
    ],
    "CriticReport": [
        ("sequence", "<u8"), ("stamp_ns", "<u8"), ("subtask", "<u4"), ("label", "u1"),
        ("reserved", "u1", 3), ("confidence", "<f8"),
    ],
    "Command": [
        ("sequence", "<u8"), ("stamp_ns", "<u8"), ("policy_step", "<u8"), ("query", "<u8"),
        ("action", "<f8", 7), ("setpoint_position_m", "<f8", 3),
        ("setpoint_velocity_m_s", "<f8", 3), ("setpoint_acceleration_m_s2", "<f8", 3),
        ("setpoint_orientation", "<f8", 4), ("reasons", "<u8"), ("mode", "u1"), ("route", "u1"),
        ("phase", "u1"), ("sub_phase", "u1"), ("flags", "<u4"),
    ],
    "PolicyQuery": [
        ("query_id", "<u8"), ("stamp_ns", "<u8"), ("state_sequence", "<u8"),
        ("policy_step", "<u8"), ("epoch", "<u8"), ("subtask", "<u4"), ("prompt_id", "<u4"),
    ],
    "RebindRequest": [
        ("request_id", "<u8"), ("stamp_ns", "<u8"), ("epoch", "<u8"), ("subtask", "<u4"),
        ("suspect", "<u2"), ("reserved", "<u2"), ("reasons", "<u8"),
    ],
    "TraceRecord": [
        ("stamp_ns", "<u8"), ("query", "<u8"), ("policy_step", "<u8"), ("evidence", "<u8"),
        ("reasons", "<u8"), ("epoch", "<u8"), ("attempt", "<u8"), ("phase_steps", "<u4"),
        ("budget", "<u4"), ("effective_horizon", "<u4"), ("attempt_steps", "<u4"),
        ("subtask", "<u4"), ("detail", "<u4"), ("target", "<u2"), ("other", "<u2"),
        ("kind", "u1"), ("phase", "u1"), ("diagnosis", "u1"), ("route", "u1"), ("mode", "u1"),
        ("sub_phase", "u1"), ("verdict", "u1"), ("failure_streak", "u1"),
        ("confidence_streak", "u1"), ("redescents", "u1"), ("gripper_closed", "u1"),
        ("lifted", "u1"), ("kappa", "<f8"), ("target_distance_m", "<f8"),
        ("destination_distance_m", "<f8"), ("gripper_width_m", "<f8"), ("ee_position_m", "<f8", 3),
        ("target_position_m", "<f8", 3), ("waypoint_m", "<f8", 3), ("base_action", "<f8", 7),
        ("action", "<f8", 7),
    ],
}

DTYPES: dict[str, np.dtype[Any]] = {name: np.dtype(fields) for name, fields in _FIELDS.items()}
for _name, _size in _fitmac.sizes():
    if DTYPES[_name].itemsize != _size:
        raise ImportError(f"fitmac.messages describes another {_name} than the library has")

_VOCABULARIES = {name: dict(words) for name, words in _fitmac.vocabularies()}
_CODES = {name: {word: code for code, word in words.items()} for name, words in
          _VOCABULARIES.items()}
_REASONS, _EVIDENCE = _fitmac.bits()

# Which vocabulary a field's code belongs to.
_WORDS = {
    "grasp_class": "GraspClass", "action_space": "ActionSpace", "frame": "ActionFrame",
    "gripper": "GripperConvention", "destination_kind": "DestinationKind",
    "relation": "PlaceRelation", "provenance": "Provenance", "verdict": "Verdict",
    "label": "CriticLabel", "mode": "Mode", "route": "Route", "phase": "Phase",
    "sub_phase": "SubPhase", "diagnosis": "Diagnosis", "kind": "EventKind",
}


def reason_names(bits: int) -> tuple[str, ...]:
    """The names of the reasons whose bits are set."""
    return tuple(name for bit, name in _REASONS if int(bits) & bit)


def evidence_names(bits: int) -> tuple[str, ...]:
    """The names of the evidence whose bits are set."""
    return tuple(name for bit, name in _EVIDENCE if int(bits) & bit)


def code(vocabulary: str, word: str) -> int:
    """The code of a word, like code("Mode", "hold")."""
    codes = _CODES[vocabulary]
    if word not in codes:
        raise ValueError(f"{vocabulary} has no {word!r}; it has {', '.join(codes)}")
    return codes[word]


class Message:
    """One message: its fields are attributes.

    Codes read as words ("hold"), bits as tuples of names, vectors as numpy
    arrays. Setting a vector takes anything that numpy takes.
    """

    __slots__ = ("_data", "_name")
    _data: np.ndarray[Any, Any]
    _name: str

    def __init__(self, name: str, data: bytes | None = None, **fields: Any) -> None:
        object.__setattr__(self, "_name", name)
        dtype = DTYPES[name]
        array = np.zeros((), dtype) if data is None else np.frombuffer(data, dtype)[0].copy()
        object.__setattr__(self, "_data", np.asarray(array))
        for field, value in fields.items():
            setattr(self, field, value)

    def __getattr__(self, field: str) -> Any:
        if field.startswith("__") or field not in (self._data.dtype.names or ()):
            raise AttributeError(f"{self._name} has no field {field}")
        value = self._data[field]
        if field in _WORDS:
            known = _VOCABULARIES[_WORDS[field]]
            return known.get(int(value), f"unknown_{int(value)}")
        if field == "reasons":
            return reason_names(int(value))
        if field == "evidence":
            return evidence_names(int(value))
        if value.ndim > 0:
            return value
        return value.item()

    def __setattr__(self, field: str, value: Any) -> None:
        if field not in (self._data.dtype.names or ()):
            raise AttributeError(f"{self._name} has no field {field}")
        if field in _WORDS and isinstance(value, str):
            value = code(_WORDS[field], value)
        wanted = self._data.dtype[field]
        try:
            if wanted.shape:
                array = np.asarray(value, dtype=wanted.base)
                if array.shape != wanted.shape:
                    raise ValueError(f"its shape is {array.shape}, not {wanted.shape}")
                value = array
            elif wanted.kind == "u" and not 0 <= int(value) <= np.iinfo(wanted).max:
                raise ValueError(f"{value} is not in 0 to {np.iinfo(wanted).max}")
            self._data[field] = value
        except (TypeError, ValueError) as error:
            raise ValueError(f"{self._name}.{field}: {error}") from error

    @property
    def array(self) -> np.ndarray[Any, Any]:
        """The message as a numpy structured scalar, shared."""
        return self._data

    def to_bytes(self) -> bytes:
        """The message as the core reads it."""
        return self._data.tobytes()

    def as_dict(self) -> dict[str, Any]:
        """The fields with words for codes; vectors as lists."""
        names = self._data.dtype.names or ()
        pairs = ((name, getattr(self, name)) for name in names if name != "reserved")
        return {n: v.tolist() if isinstance(v, np.ndarray) else v for n, v in pairs}

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Message) and self.to_bytes() == other.to_bytes()

    def __repr__(self) -> str:
        return f"<{self._name} {self.as_dict()}>"


def message(name: str, **fields: Any) -> Message:
    """A new message, like message("StateSample", gripper_width_m=0.08)."""
    if name not in DTYPES:
        raise ValueError(f"there is no message {name!r}; there are {', '.join(DTYPES)}")
    return Message(name, **fields)
