"""Kinematics of the Panda and jerk-limited motion, numpy in and out.

Metres, radians, seconds; poses of the tool centre point (0.1034 m beyond the hand, between the
finger pads) in the base frame (panda_link0); quaternions (w, x, y, z).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Union

import numpy as np

from . import _fitmac

__all__ = [
    "JERK_MAX", "ACCELERATION_MAX", "LOWER", "READY", "UPPER", "VELOCITY_MAX", "Motion", "Pose",
    "Solution", "forward", "inverse", "jacobian", "plan",
]

Array = np.ndarray[Any, np.dtype[np.float64]]
# What numpy takes for an array of numbers.
Numbers = Union[Sequence[float], Sequence[Sequence[float]], np.ndarray[Any, Any]]

LOWER, UPPER, VELOCITY_MAX, ACCELERATION_MAX, JERK_MAX, READY = (
    np.array(row) for row in _fitmac.panda_constants()
)
"""Limits of the joints (rad, rad/s, rad/s^2, rad/s^3; Franka's published ones), and the customary
posture with the hand pointing down."""


@dataclass(frozen=True)
class Pose:
    """A place and an orientation."""

    position_m: Array
    orientation: Array
    """Unit quaternion (w, x, y, z)."""

    def matrix(self) -> Array:
        """The homogeneous transform, 4 x 4."""
        w, x, y, z = self.orientation
        transform = np.eye(4)
        transform[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        transform[:3, 3] = self.position_m
        return transform


@dataclass(frozen=True)
class Solution:
    """The nearest that an inverse found."""

    q: Array
    """Joint positions, rad, within the limits."""
    reached: bool
    """Whether the tool is at the target within the tolerances."""
    position_error_m: float
    rotation_error_rad: float
    steps: int


def _array(name: str, value: Any, length: int) -> Array:
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: {error}") from error
    if array.shape[-1:] != (length,) or array.ndim > 2:
        raise ValueError(f"{name}: its shape is {array.shape}, not ({length},) or (n, {length})")
    return array


def _vector(name: str, value: Any, length: int) -> Array:
    array = _array(name, value, length)
    if array.ndim != 1:
        raise ValueError(f"{name}: its shape is {array.shape}, not ({length},)")
    return array


def forward(q: Numbers) -> Pose:
    """The tool's pose at joint positions `q`, (7,) or (n, 7), rad; arrays of n then.

    Raises ValueError for what is not finite, naming the joint.
    """
    array = _array("q", q, 7)
    poses = [_fitmac.panda_forward(row.tolist()) for row in array.reshape(-1, 7)]
    shape = array.shape[:-1]
    return Pose(
        np.array([position for position, _ in poses]).reshape(*shape, 3),
        np.array([orientation for _, orientation in poses]).reshape(*shape, 4),
    )


def jacobian(q: Numbers) -> Array:
    """The geometric Jacobian, (6, 7) or (n, 6, 7): linear above angular, base frame."""
    array = _array("q", q, 7)
    rows = [_fitmac.panda_jacobian(row.tolist()) for row in array.reshape(-1, 7)]
    return np.array(rows).reshape(*array.shape[:-1], 6, 7)


def inverse(
    pose: Pose,
    seed: Numbers | None = None,
    *,
    restarts: int = 32,
    position_tolerance_m: float = 1e-6,
    rotation_tolerance_rad: float = 1e-6,
) -> Solution | None:
    """Joint positions that bring the tool to `pose`, searched from `seed` (default: READY).

    None if the target is farther away than the arm is long. The same question always has the same
    answer. Raises ValueError for what cannot be computed with.
    """
    start = READY if seed is None else _vector("seed", seed, 7)
    found = _fitmac.panda_inverse(
        _vector("pose.position_m", pose.position_m, 3).tolist(),
        _vector("pose.orientation", pose.orientation, 4).tolist(),
        start.tolist(),
        restarts,
        position_tolerance_m,
        rotation_tolerance_rad,
    )
    if found is None:
        return None
    reached, q, position_error_m, rotation_error_rad, steps = found
    return Solution(np.array(q), reached, position_error_m, rotation_error_rad, steps)


class Motion:
    """A motion of 1 to 12 axes within limits of velocity, acceleration and jerk: see `plan`."""

    def __init__(self, raw: _fitmac.Motion) -> None:
        self._raw = raw

    @property
    def duration_s(self) -> float:
        """From the start to the target."""
        return self._raw.duration_s

    @property
    def synchronised(self) -> bool:
        """Whether all axes arrive at the same time."""
        return self._raw.synchronised

    def at(self, time_s: Any) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration at a time or times: (axes,) or (n, axes).

        After the end the axes keep the velocity of the target.
        """
        times = np.asarray(time_s, dtype=np.float64)
        if not np.all(np.isfinite(times)) or np.any(times < 0):
            raise ValueError("time_s: give times from 0 on")
        states = np.array([self._raw.at(float(t)) for t in times.reshape(-1)])
        states = states.reshape(*times.shape, 3, -1)
        return states[..., 0, :], states[..., 1, :], states[..., 2, :]


def plan(
    position: Numbers,
    target: Numbers,
    *,
    velocity_max: Numbers,
    acceleration_max: Numbers,
    jerk_max: Numbers,
    velocity: Numbers | None = None,
    acceleration: Numbers | None = None,
    target_velocity: Numbers | None = None,
) -> Motion:
    """The quickest motion of all axes to `target` within the limits, arriving together.

    Velocities and accelerations are 0 where they are left out. Raises ValueError, naming what
    cannot be planned with.
    """
    start = np.asarray(position, dtype=np.float64)
    if start.ndim != 1 or not 1 <= len(start) <= 12:
        raise ValueError(f"position: its shape is {start.shape}; 1 to 12 axes can be planned")

    def axes(name: str, value: Any) -> list[float]:
        given = np.zeros(len(start)) if value is None else value
        return [float(x) for x in _vector(name, given, len(start))]

    return Motion(
        _fitmac.Motion(
            start.tolist(),
            axes("velocity", velocity),
            axes("acceleration", acceleration),
            axes("target", target),
            axes("target_velocity", target_velocity),
            axes("velocity_max", velocity_max),
            axes("acceleration_max", acceleration_max),
            axes("jerk_max", jerk_max),
        )
    )
