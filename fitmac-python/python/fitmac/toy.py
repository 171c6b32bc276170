"""A toy of a table, an arm and a hand, with Gymnasium's `reset` and `step`.

The arm is a point that covers a quarter of an increment in a step, as LIBERO's
does; fingers close on what stands between them; what they let go falls.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .wrap import Object, Poses

_OPEN_M = 0.08
_HALF = {"can": (0.03, 0.03, 0.04), "soup": (0.03, 0.03, 0.04), "plate": (0.09, 0.09, 0.01)}


class ToyEnv:
    """Two cans and a plate. The can belongs on the plate."""

    def __init__(self) -> None:
        self._rng = np.random.default_rng()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        self._rng = np.random.default_rng(seed)
        place = {"can": (0.50, -0.10), "soup": (0.50, 0.12), "plate": (0.35, 0.25)}
        self._at = {
            name: np.array([*(np.array(xy) + self._rng.uniform(-0.01, 0.01, 2)), _HALF[name][2]])
            for name, xy in place.items()
        }
        self._ee = np.array([0.45, 0.0, 0.30])
        self._width, self._held, self._closing = _OPEN_M, "", False
        return self._observe(), {}

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        action = np.asarray(action, float)
        moved = 0.27 * 0.05 * action[:3]
        self._ee = self._ee + moved
        self._ee[2] = max(self._ee[2], 0.01)
        if self._held:
            self._at[self._held] = self._at[self._held] + moved
        self._closing = bool(action[6] > 0)
        self._move_fingers()
        success = self._is_placed()
        return self._observe(), float(success), success, False, {"success": success}

    def poses(self) -> Poses:
        """Hand and objects as a perfect perception sees them."""
        things = [
            Object(name, at.copy(), _HALF[name], "fixture" if name == "plate" else "can")
            for name, at in self._at.items()
        ]
        return Poses(self._ee.copy(), self._width, things)

    def _observe(self) -> dict[str, Any]:
        return {
            "ee": self._ee.copy(), "width": self._width, "held": self._held,
            "closing": self._closing, "at": {name: at.copy() for name, at in self._at.items()},
        }

    def _move_fingers(self) -> None:
        between = next((n for n in ("can", "soup") if self._fits(n)), "")
        stop = 2 * _HALF[between][1] if between else 0.0
        target = stop if self._closing else _OPEN_M
        self._width += float(np.clip(target - self._width, -0.01, 0.01))
        if self._closing and between and self._width <= stop + 1e-9:
            self._held = between
        elif not self._closing and self._held:
            self._let_go()

    def _fits(self, name: str) -> bool:
        dx, dy, dz = np.abs(self._at[name] - self._ee)
        return bool(dx < 0.02 and dy < 0.015 and dz < _HALF[name][2])

    def _let_go(self) -> None:
        at, plate = self._at[self._held], self._at["plate"]
        on_plate = bool(np.all(np.abs(at[:2] - plate[:2]) < _HALF["plate"][:2]))
        at[2] = _HALF[self._held][2] + (2 * _HALF["plate"][2] if on_plate else 0.0)
        self._held = ""

    def _is_placed(self) -> bool:
        off = np.abs(self._at["can"][:2] - self._at["plate"][:2])
        low = self._at["can"][2] < 0.07
        return bool(self._held != "can" and low and np.all(off < 0.06))


class ToyPolicy:
    """Picks `target` and places it on the plate; `stall_m` above it, it stops."""

    def __init__(self, target: str = "can", stall_m: float = 0.0) -> None:
        self._target, self._stall_m = target, stall_m

    def __call__(self, observation: dict[str, Any], prompt: str) -> np.ndarray[Any, Any]:
        ee, actions = np.array(observation["ee"]), []
        for _ in range(8):
            action = self._act(observation, ee)
            ee = ee + 0.27 * 0.05 * action[:3]
            actions.append(action)
        return np.array(actions)

    def _act(self, seen: dict[str, Any], ee: Any) -> np.ndarray[Any, Any]:
        goal = seen["at"][self._target]
        if seen["held"] == self._target:
            plate = seen["at"]["plate"]
            if np.hypot(*(plate - ee)[:2]) > 0.015:
                lift = ee if ee[2] < 0.20 else plate
                return _towards(ee, [lift[0], lift[1], 0.25], 1.0)
            above = ee[2] > plate[2] + 0.07
            return _towards(ee, plate, 1.0) if above else _towards(ee, ee, -1.0)
        off = float(np.hypot(*(goal - ee)[:2]))
        if off > 0.01:
            return _towards(ee, [goal[0], goal[1], max(goal[2] + 0.10, min(ee[2], 0.3))], -1.0)
        if ee[2] - goal[2] > max(self._stall_m, 0.01):
            return _towards(ee, [goal[0], goal[1], goal[2] + self._stall_m], -1.0)
        return _towards(ee, ee, -1.0 if self._stall_m else 1.0)


def _towards(ee: Any, goal: Any, gripper: float) -> np.ndarray[Any, Any]:
    share = np.clip((np.asarray(goal) - ee) / (0.27 * 0.05), -1.0, 1.0)
    return np.array([*share, 0.0, 0.0, 0.0, gripper])
