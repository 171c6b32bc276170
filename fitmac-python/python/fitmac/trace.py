"""Traces that `fitmac rt --trace` records (MCAP), tick by tick.

Needs the packages of `pip install '.[replay]'`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from os import PathLike
from typing import Any, Union

import numpy as np

from .messages import DTYPES, Message

__all__ = ["Tick", "Trace", "TraceError"]

Path = Union[str, "PathLike[str]"]

_TOLD = {"/state": "StateSample", "/chunk": "ActionChunk", "/grounding": "GroundingRecord",
         "/plan": "Plan", "/verifier": "VerifierReport", "/critic": "CriticReport"}
_ANSWERED = {"/command": "Command", "/query": "PolicyQuery", "/rebind": "RebindRequest",
             "/trace": "TraceRecord", "/event": "TraceRecord"}
_NAMES = {**_TOLD, **_ANSWERED}

_HEAD = np.dtype([
    ("length", "<u4"), ("contents", "<u4"), ("tick", "<u8"), ("now_ns", "<u8"),
    ("lateness_ns", "<u8"), ("busy_before_ns", "<u8"), ("skipped", "<u8"), ("request", "<u8"),
])
# Which messages a tick has, by the head's bits; the command is always there.
_CONTENTS = {"state": 1, "chunk": 2, "grounding": 4, "plan": 8, "verifier": 16, "critic": 32,
             "query": 64, "rebind": 128, "trace": 256, "event": 1024, "command": 0}
_MESSAGES = sum(_CONTENTS.values())
_RECORD_MAX = 64 << 20


class TraceError(ValueError):
    """A file that is no trace of ours, or holds what no trace holds."""


@dataclass
class Tick:
    """What the core was told in a tick, and what it answered."""

    number: int
    now_ns: int
    request: int
    told: dict[str, Message] = field(default_factory=dict)
    """By the names of `Controller.tick`: state, chunk, grounding, plan, verifier, critic."""
    answered: dict[str, Message] = field(default_factory=dict)
    """By the names of `Output`: command, query, rebind, trace, event."""
    contents: int = 0

    def is_whole(self) -> bool:
        """Whether all is there that was recorded: a file may end within a tick."""
        seen = sum(_CONTENTS[name] for name in (*self.told, *self.answered))
        return "command" in self.answered and seen == self.contents & _MESSAGES


class Trace:
    """A trace: what it says of itself, and its ticks.

    `damage` says, after the ticks were read, why they could not be read to the end.
    """

    def __init__(self, path: Path) -> None:
        try:
            from mcap.exceptions import McapError
            from mcap.stream_reader import StreamReader
        except ImportError as error:
            raise ImportError("reading traces needs `pip install 'fitmac[replay]'`") from error
        self.path = str(path)
        self.damage: str | None = None
        self._reader, self._errors = StreamReader, (McapError, EOFError, OSError, ValueError)
        self.metadata = self._read_metadata()

    def _records(self) -> Iterator[Any]:
        with open(self.path, "rb") as file:
            yield from self._reader(file, record_size_limit=_RECORD_MAX).records

    def _read_metadata(self) -> dict[str, str]:
        from mcap.records import Chunk, Metadata

        try:
            for record in self._records():
                if isinstance(record, Metadata) and record.name == "fitmac":
                    return dict(record.metadata)
                if isinstance(record, Chunk):
                    break
        except FileNotFoundError:
            raise
        except self._errors as error:
            raise TraceError(f"{self.path} is no MCAP file: {error!r}") from error
        raise TraceError(f"{self.path} is no FIT-MAC trace: give a file of `fitmac rt --trace`")

    def ticks(self) -> Iterator[Tick]:
        """The ticks, in order, up to the damage if there is any."""
        from mcap.records import Channel, Message as Recorded

        self.damage = None
        topics: dict[int, str] = {}
        tick: Tick | None = None
        try:
            for record in self._records():
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                    continue
                if not isinstance(record, Recorded):
                    continue
                topic = topics.get(record.channel_id, "")
                if topic == "/tick":
                    if tick is not None:
                        yield tick
                    head = decode(_HEAD, record.data)
                    tick = Tick(int(head["tick"]), int(head["now_ns"]), int(head["request"]),
                                contents=int(head["contents"]))
                elif topic in _NAMES and tick is not None:
                    data = decode(DTYPES[_NAMES[topic]], record.data)
                    message = Message(_NAMES[topic], data.tobytes())
                    (tick.told if topic in _TOLD else tick.answered)[topic[1:]] = message
        except self._errors as error:
            self.damage = f"{self.path} cannot be read to its end: {error!r}"
            return
        if tick is not None and tick.is_whole():
            yield tick
        elif tick is not None:
            self.damage = f"{self.path} ends within tick {tick.number}"


def decode(dtype: np.dtype[Any], data: bytes) -> np.ndarray[Any, Any]:
    """A message from its protobuf form; what is missing is zero."""
    out = bytearray(dtype.itemsize)
    _fill(dtype, memoryview(data), out, 0)
    return np.frombuffer(out, dtype).reshape(())


_PLANS: dict[np.dtype[Any], list[tuple[int, np.dtype[Any], int]]] = {}


def _plan(dtype: np.dtype[Any]) -> list[tuple[int, np.dtype[Any], int]]:
    """Offset, element and count of each field, in the order of the field numbers from 1."""
    if dtype not in _PLANS:
        fields: Any = dtype.fields
        _PLANS[dtype] = [
            (int(offset), of.base, int(np.prod(of.shape, dtype=int)))
            for of, offset in (fields[name][:2] for name in dtype.names or ())
        ]
    return _PLANS[dtype]


def _fill(dtype: np.dtype[Any], data: memoryview, out: bytearray, base: int) -> None:
    plan = _plan(dtype)
    at, filled = 0, [0] * len(plan)
    while at < len(data):
        key, at = _varint(data, at)
        number, wire = key >> 3, key & 7
        if wire == 2:
            length, at = _varint(data, at)
        elif wire in (1, 5):
            length = 8 if wire == 1 else 4
        elif wire == 0:
            value, at = _varint(data, at)
            length = 0
        else:
            raise TraceError(f"a field has the unknown wire type {wire}")
        if at + length > len(data):
            raise TraceError("a field is longer than its message")
        piece = data[at : at + length]
        at += length
        if not 1 <= number <= len(plan):
            continue  # the names of bits, for people
        offset, of, count = plan[number - 1]
        place, used = base + offset, filled[number - 1]
        if wire == 0:
            piece = memoryview(_integer(value, of.itemsize))
        elif wire == 2 and of.kind == "u" and of.itemsize > 1:
            piece = memoryview(_unpack(piece, of.itemsize))
        if of.fields is not None:
            if used >= count:
                raise TraceError("an array has too many elements")
            _fill(of, piece, out, place + used * of.itemsize)
            filled[number - 1] += 1
            continue
        if len(piece) + used > count * of.itemsize or len(piece) % of.itemsize:
            raise TraceError("a field does not have the size that its message says")
        out[place + used : place + used + len(piece)] = piece
        filled[number - 1] += len(piece)


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    value, shift = 0, 0
    while at < len(data) and shift < 70:
        byte = data[at]
        value |= (byte & 0x7F) << shift
        at += 1
        if byte < 0x80:
            return value, at
        shift += 7
    raise TraceError("a number does not end")


def _integer(value: int, size: int) -> bytes:
    if value >= 1 << (8 * size):
        raise TraceError("a number is too large for its field")
    return value.to_bytes(size, "little")


def _unpack(data: memoryview, size: int) -> bytes:
    at, numbers = 0, []
    while at < len(data):
        value, at = _varint(data, at)
        numbers.append(_integer(value, size))
    return b"".join(numbers)
