"""FIT-MAC around a policy and a Gymnasium-style environment."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Union

import numpy as np

from .controller import Config, Controller, Output
from .messages import Message

# What numpy takes for a short vector.
Vector = Union[Sequence[float], np.ndarray[Any, Any]]

# A policy step of the environment, and how often the core looks meanwhile.
_STEP_NS = 50_000_000
_TICKS = 5


@dataclass(frozen=True)
class Object:
    """A thing as your perception or simulator knows it, base frame."""

    name: str
    position_m: Vector
    half_extent_m: Vector
    grasp_class: str = "box"
    """"box", "can", "bottle", "bowl" or "fixture" (what is not picked)."""
    orientation: Vector = (1.0, 0.0, 0.0, 0.0)
    confidence: float = 1.0


@dataclass(frozen=True)
class Poses:
    """What the core needs to know of the world at a step."""

    ee_position_m: Vector
    gripper_width_m: float
    objects: Sequence[Object]
    ee_orientation: Vector = (0.0, 1.0, 0.0, 0.0)
    joint_position_rad: Vector = (0.0,) * 7


@dataclass(frozen=True)
class Task:
    """What the instruction means: pick `target`, place it `relation` `destination`."""

    target: str
    destination: str
    relation: str = "on"
    """"on" or "in"."""
    region_half_extent_m: Vector = (0.06, 0.06, 0.0)
    """Of the region in the destination; z is the depth of a container."""
    prompt: str = ""
    confidence: float = 0.95


@dataclass(frozen=True)
class Step:
    """One step of the environment, and what was decided in it."""

    index: int
    action: np.ndarray[Any, Any]
    mode: str
    route: str
    phase: str
    reasons: tuple[str, ...]
    reward: float


@dataclass
class Run:
    """An episode."""

    steps: list[Step] = field(default_factory=list)
    records: list[Message] = field(default_factory=list)
    """The record of each query, and of each event."""
    success: bool = False
    info: dict[str, Any] = field(default_factory=dict)

    def interventions(self) -> int:
        """Steps that FIT-MAC decided in the policy's place."""
        taken = ("execution_correction", "pending_correction")
        return sum(step.route in taken for step in self.steps)

    def frame(self) -> Any:
        """The records as a pandas frame, a row a record."""
        import pandas  # type: ignore[import-untyped,unused-ignore]

        return pandas.DataFrame([record.as_dict() for record in self.records])


class Wrapped:
    """A policy and an environment with FIT-MAC between them: see `wrap`."""

    def __init__(
        self,
        policy: Callable[[Any, str], Any],
        env: Any,
        poses: Callable[[Any, Any], Poses],
        task: Task,
        config: Config | None = None,
    ) -> None:
        self._policy, self._env, self._poses, self._task = policy, env, poses, task
        self._config = config or Config()

    def run(self, max_steps: int = 280, seed: int | None = None) -> Run:
        """Runs an episode: until the environment ends it, at most `max_steps`."""
        observation, _ = self._env.reset(seed=seed)
        loop = _Loop(self._policy, self._task, self._config)
        run = Run()
        for index in range(max_steps):
            poses = self._poses(self._env, observation)
            command = loop.step(observation, poses, run.records)
            action = np.array(command.action)
            observation, reward, terminated, truncated, info = self._env.step(action)
            run.steps.append(
                Step(index, action, command.mode, command.route, command.phase,
                     command.reasons, float(reward))
            )
            run.info = info
            run.success = bool(info.get("success", terminated))
            if terminated or truncated:
                break
        return run


def wrap(
    policy: Callable[[Any, str], Any],
    env: Any,
    *,
    poses: Callable[[Any, Any], Poses],
    task: Task,
    config: Config | None = None,
) -> Wrapped:
    """Puts FIT-MAC between `policy` and `env`.

    `policy(observation, prompt)` gives actions [H, 7] (or one, [7]) by LIBERO's
    convention: increments in [-1, 1] of 0.05 m and 0.5 rad, gripper -1 open, +1
    close. `env` has `reset(seed=...)` and `step(action)` as Gymnasium has them, a
    step is 50 ms. `poses(env, observation)` gives the poses of hand and objects.
    """
    for name, value in (("policy", policy), ("poses", poses)):
        if not callable(value):
            raise TypeError(f"{name} must be callable, not {type(value).__name__}")
    for name in ("reset", "step"):
        if not callable(getattr(env, name, None)):
            raise TypeError(f"env must have {name}(), as a Gymnasium environment has")
    return Wrapped(policy, env, poses, task, config)


class _Loop:
    """The controller, and what stands around it in one episode."""

    def __init__(self, policy: Callable[[Any, str], Any], task: Task, config: Config) -> None:
        self._policy, self._task = policy, task
        self._controller = Controller(config)
        self._now_ns = 0
        self._ids: dict[str, int] = {}
        self._sequence = self._chunks = self._groundings = self._applied = 0
        self._chunk: Message | None = None
        self._grounding: Message | None = None

    def step(self, observation: Any, poses: Poses, records: list[Message]) -> Message:
        """One policy step; the world stands still while the policy thinks."""
        for _ in range(_TICKS):
            self._now_ns += _STEP_NS // _TICKS
            output = self._tick(poses)
            records.extend(r for r in (output.trace, output.event) if r is not None)
            if output.query is not None:
                self._chunk = self._ask(observation, output.query)
            if output.rebind is not None:
                self._grounding = self._ground(poses, output.rebind)
        return output.command

    def _tick(self, poses: Poses) -> Output:
        chunk, self._chunk = self._chunk, None
        grounding, self._grounding = self._grounding, None
        output = self._controller.tick(
            self._now_ns, self._state(poses), chunk=chunk, grounding=grounding
        )
        self._applied = output.command.sequence
        return output

    def _state(self, poses: Poses) -> Message:
        self._sequence += 1
        state = Message(
            "StateSample", sequence=self._sequence, session=1, stamp_ns=self._now_ns,
            applied_command=self._applied, joint_position_rad=poses.joint_position_rad,
            ee_position_m=poses.ee_position_m, ee_orientation=poses.ee_orientation,
            gripper_width_m=poses.gripper_width_m, object_count=len(poses.objects),
        )
        room = state.array["objects"]
        if len(poses.objects) > len(room):
            raise ValueError(f"objects: {len(poses.objects)} of them, there is room for {len(room)}")
        for index, thing in enumerate(poses.objects):
            sample = Message(
                "ObjectSample", id=self._id(thing.name), grasp_class=thing.grasp_class, visible=1,
                stamp_ns=self._now_ns, position_m=thing.position_m, orientation=thing.orientation,
                half_extent_m=thing.half_extent_m, confidence=thing.confidence,
            )
            room[index] = sample.array
        return state

    def _id(self, name: str) -> int:
        return self._ids.setdefault(name, len(self._ids) + 1)

    def _ask(self, observation: Any, query: Message) -> Message:
        actions = np.atleast_2d(np.asarray(self._policy(observation, self._task.prompt), float))
        if actions.ndim != 2 or actions.shape[1] != 7 or not 1 <= len(actions) <= 64:
            raise ValueError(f"policy: it gave actions of shape {actions.shape}, not [1 to 64, 7]")
        self._chunks += 1
        chunk = Message(
            "ActionChunk", sequence=self._chunks, session=1, observation_ns=self._now_ns,
            stamp_ns=self._now_ns, query_id=query.query_id, epoch=query.epoch,
            subtask=query.subtask, prompt_id=query.prompt_id, horizon=len(actions),
            action_space="osc_pose_delta", frame="base", gripper="minus_one_open",
        )
        chunk.array["actions"][: len(actions)] = actions
        return chunk

    def _ground(self, poses: Poses, request: Message) -> Message:
        task = self._task
        known = {thing.name: thing for thing in poses.objects}
        for name, value in (("target", task.target), ("destination", task.destination)):
            if value not in known:
                raise ValueError(f"task.{name}: there is no {value!r} among {', '.join(known)}")
        self._groundings += 1
        grounding = Message(
            "GroundingRecord", sequence=self._groundings, session=1, stamp_ns=self._now_ns,
            epoch=request.epoch + 1, subtask=request.subtask, prompt_id=1,
            target=self._id(task.target), destination=self._id(task.destination),
            destination_kind="direct", relation=task.relation, provenance="rules",
            confidence=task.confidence, candidate_count=0,
            region_offset_m=(0.0, 0.0, known[task.destination].half_extent_m[2]),
            region_half_extent_m=task.region_half_extent_m,
        )
        things = [t for t in poses.objects if t.grasp_class != "fixture"][:16]
        room = grounding.array["candidates"]
        for place, thing in zip(room, things):
            place["id"], place["compatible"] = self._id(thing.name), thing.name == task.target
            place["confidence"] = task.confidence if thing.name == task.target else 0.0
        grounding.candidate_count = len(things)
        return grounding
