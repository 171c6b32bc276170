from collections.abc import Sequence
from typing import final

__all__ = [
    "Config",
    "Controller",
    "Motion",
    "Snapshot",
    "bits",
    "panda_constants",
    "panda_forward",
    "panda_inverse",
    "panda_jacobian",
    "parameters",
    "sizes",
    "vocabularies",
]

@final
class Config:
    def __new__(cls, profile: str) -> Config: ...
    def assign(self, key: str, text: str) -> None: ...
    def check(self) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...

@final
class Snapshot: ...

@final
class Controller:
    def __new__(cls, config: Config) -> Controller: ...
    def tick(
        self,
        now_ns: int,
        state: bytes | None,
        chunk: bytes | None,
        grounding: bytes | None,
        plan: bytes | None,
        verifier: bytes | None,
        critic: bytes | None,
        request: int,
    ) -> tuple[bytes, bytes | None, bytes | None, bytes | None, bytes | None]: ...
    def snapshot(self) -> Snapshot: ...
    def restore(self, snapshot: Snapshot) -> None: ...
    def reset(self) -> None: ...

def sizes() -> list[tuple[str, int]]: ...
def parameters() -> list[tuple[str, str, float, float, float, str]]: ...
def vocabularies() -> list[tuple[str, list[tuple[int, str]]]]: ...
def bits() -> tuple[list[tuple[int, str]], list[tuple[int, str]]]: ...
def panda_forward(q: Sequence[float]) -> tuple[list[float], list[float]]:
    """Position (m) and orientation (w, x, y, z) of the tool centre point."""

def panda_jacobian(q: Sequence[float]) -> list[list[float]]:
    """The 6 x 7 geometric Jacobian of the tool centre point, base frame."""

def panda_inverse(
    position: Sequence[float],
    orientation: Sequence[float],
    seed: Sequence[float],
    restarts: int,
    position_tolerance_m: float,
    rotation_tolerance_rad: float,
) -> tuple[bool, list[float], float, float, int] | None: ...
def panda_constants() -> list[list[float]]: ...
@final
class Motion:
    def __new__(
        cls,
        position: Sequence[float],
        velocity: Sequence[float],
        acceleration: Sequence[float],
        target: Sequence[float],
        target_velocity: Sequence[float],
        velocity_max: Sequence[float],
        acceleration_max: Sequence[float],
        jerk_max: Sequence[float],
    ) -> Motion: ...
    @property
    def duration_s(self) -> float: ...
    @property
    def synchronised(self) -> bool: ...
    def at(self, time_s: float) -> list[list[float]]: ...
