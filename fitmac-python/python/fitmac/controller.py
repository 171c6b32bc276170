"""The decision core, one tick at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from . import _fitmac
from ._fitmac import Snapshot
from .messages import Message, code

__all__ = ["Config", "Controller", "Output", "Snapshot"]


class Config:
    """Checked parameters: a profile, and settings over it.

    Settings are keys like "gate.failure_streak", or tables as a configuration
    file has them: `Config(settings=tomllib.load(file))`.

    Raises KeyError for a parameter that does not exist, TypeError for a value of
    the wrong type, ValueError for values out of range; each names the parameter.
    """

    def __init__(
        self, profile: str = "guarded", settings: Mapping[str, Any] | None = None
    ) -> None:
        settings = dict(settings or {})
        self._raw = _fitmac.Config(settings.pop("profile", profile))
        for key, value in settings.items():
            self._set(key, value)
        self._raw.check()

    def _set(self, key: str, value: Any) -> None:
        if isinstance(value, Mapping):
            for name, inner in value.items():
                self._set(f"{key}.{name}", inner)
        elif isinstance(value, bool):
            self._raw.assign(key, "true" if value else "false")
        elif isinstance(value, (int, float, str)):
            self._raw.assign(key, str(value))
        else:
            raise TypeError(f"{key} cannot be {value!r}: give a number, a bool or a word")

    @staticmethod
    def parameters() -> list[dict[str, Any]]:
        """Every numeric parameter with unit, default, range and meaning."""
        names = ("key", "unit", "default", "min", "max", "doc")
        return [dict(zip(names, row)) for row in _fitmac.parameters()]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Config) and self._raw == other._raw


def _bytes(message: Message | None) -> bytes | None:
    return None if message is None else message.to_bytes()


@dataclass(frozen=True)
class Output:
    """The answer to one tick."""

    command: Message
    query: Message | None
    rebind: Message | None
    trace: Message | None
    event: Message | None


class Controller:
    """Watches the policy and decides who acts."""

    def __init__(self, config: Config | None = None) -> None:
        self._raw = _fitmac.Controller((config or Config())._raw)

    def tick(
        self,
        now_ns: int,
        state: Message | None = None,
        *,
        chunk: Message | None = None,
        grounding: Message | None = None,
        plan: Message | None = None,
        verifier: Message | None = None,
        critic: Message | None = None,
        request: str = "none",
    ) -> Output:
        """Decides one control tick; `None` means that nothing new arrived.

        `request` is "none", "stop" (a controlled stop) or "reset" (another
        episode).
        """
        command, query, rebind, trace, event = self._raw.tick(
            now_ns,
            _bytes(state),
            _bytes(chunk),
            _bytes(grounding),
            _bytes(plan),
            _bytes(verifier),
            _bytes(critic),
            code("Request", request),
        )
        return Output(
            Message("Command", command),
            None if query is None else Message("PolicyQuery", query),
            None if rebind is None else Message("RebindRequest", rebind),
            None if trace is None else Message("TraceRecord", trace),
            None if event is None else Message("TraceRecord", event),
        )

    def snapshot(self) -> Snapshot:
        """What the controller remembers now.

        It lives as long as this process: it cannot be pickled. To go on in
        another one, replay the inputs.
        """
        return self._raw.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Goes on from a snapshot of a controller with the same parameters.

        Raises ValueError for a snapshot of one with others.
        """
        self._raw.restore(snapshot)

    def reset(self) -> None:
        """As new: forgets everything but its parameters."""
        self._raw.reset()
