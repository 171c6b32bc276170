from collections.abc import Sequence
from typing import final

__all__ = [
    "Config",
    "Controller",
    "Snapshot",
    "bits",
    "panda_forward",
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
