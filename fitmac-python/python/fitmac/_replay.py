"""A recorded run through the core again: the same answers, bit for bit, or where they part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .controller import Config, Controller, Output
from .messages import Message
from .trace import Path, Trace, TraceError

__all__ = ["Parting", "Replay", "recorded_config", "replay"]

_REQUESTS = ("none", "stop", "reset")
_ANSWERS = ("command", "query", "rebind", "trace", "event")


@dataclass(frozen=True)
class Parting:
    """Where an answer differs from the recorded one."""

    tick: int
    now_ns: int
    message: str
    """command, query, rebind, trace or event."""
    field: str
    """Its first differing field, like "action[2]"; empty if only one of the two was sent."""
    recorded: Any
    replayed: Any

    def __str__(self) -> str:
        if not self.field:
            return f"tick {self.tick}: {self.message}: sent by one of the two only"
        return (f"tick {self.tick}: {self.message}.{self.field}: "
                f"recorded {self.recorded}, replayed {self.replayed}")


@dataclass
class Replay:
    """What a replay found."""

    ticks: int = 0
    different_ticks: int = 0
    first: Parting | None = None
    """The first difference of all."""
    first_decision: Parting | None = None
    """The first decision (trace record) that differs."""
    stopped: str | None = None
    """Why the trace cannot be replayed further, if so."""

    @property
    def agrees(self) -> bool:
        """Every answer of a whole trace is the recorded one."""
        return self.ticks > 0 and self.first is None and self.stopped is None


def recorded_config(trace: Trace, what_if: Mapping[str, Any] | None = None) -> Config:
    """The parameters that a trace was recorded with, with settings over them."""
    text = trace.metadata.get("params")
    if text is None:
        raise TraceError(f"{trace.path} does not say its parameters: it cannot be replayed")
    settings = _toml(text)
    for key, value in (what_if or {}).items():
        table = settings
        *path, name = key.split(".")
        for part in path:
            table = table.setdefault(part, {})
        table[name] = value
    return Config(settings=settings)


def replay(path: Path, what_if: Mapping[str, Any] | None = None) -> Replay:
    """Feeds the recorded inputs to the core and compares every answer.

    With `what_if`, settings like {"gate.failure_streak": 2}, it shows where decisions would have
    parted; what is recorded after that is no consequence of the other decisions any more.
    """
    trace = Trace(path)
    controller, report = Controller(recorded_config(trace, what_if)), Replay()
    for tick in trace.ticks():
        if tick.number != report.ticks + 1:
            report.stopped = (
                f"the trace begins at tick {tick.number}: what the controller remembered then is "
                "unknown" if report.ticks == 0 else
                f"ticks are missing between {report.ticks} and {tick.number}"
            )
            return report
        if not 0 <= tick.request < len(_REQUESTS):
            raise TraceError(f"tick {tick.number} has the unknown request {tick.request}")
        output = controller.tick(tick.now_ns, request=_REQUESTS[tick.request], **tick.told)
        report.ticks = tick.number
        _compare(tick.number, tick.now_ns, tick.answered, output, report)
    report.stopped = trace.damage
    return report


def _compare(
    number: int, now_ns: int, recorded: Mapping[str, Message], output: Output, report: Replay
) -> None:
    different = False
    for name in _ANSWERS:
        before, after = recorded.get(name), getattr(output, name)
        if before == after:
            continue
        different = True
        if report.first is not None and (name != "trace" or report.first_decision is not None):
            continue
        field, left, right = _first_field(before, after)
        parting = Parting(number, now_ns, name, field, left, right)
        report.first = report.first or parting
        if name == "trace":
            report.first_decision = report.first_decision or parting
    report.different_ticks += different


def _first_field(before: Message | None, after: Message | None) -> tuple[str, Any, Any]:
    if before is None or after is None:
        return "", before, after
    return _first_in(before.array, after.array)


def _first_in(a: Any, b: Any, prefix: str = "") -> tuple[str, Any, Any]:
    for name in a.dtype.names:
        left, right = np.asarray(a[name]), np.asarray(b[name])
        if left.tobytes() == right.tobytes():
            continue
        for index in np.ndindex(left.shape):
            x, y = left[index], right[index]
            if x.tobytes() != y.tobytes():
                place = prefix + name + "".join(f"[{i}]" for i in index)
                if x.dtype.names:
                    return _first_in(x, y, place + ".")
                return place, x.item(), y.item()
    raise AssertionError("the messages are equal")


def _toml(text: str) -> dict[str, Any]:
    try:
        import tomllib
    except ImportError:
        import tomli as tomllib  # type: ignore[import-not-found,no-redef,unused-ignore]
    return tomllib.loads(text)
