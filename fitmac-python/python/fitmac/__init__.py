"""FIT-MAC: runtime assurance for robots that run a vision-language-action policy.

`wrap(policy, env, ...)` puts it around a policy and an environment;
`Controller` is the decision core itself, one tick at a time; `replay` runs a
recorded trace again, `read_results` reads what `fitmac eval` wrote, `kinematics`
has the arm and its motion. Units are SI, positions are in the robot's base frame, quaternions are (w, x, y, z), times are
nanoseconds. FIT-MAC is not a safety function.
"""

from . import kinematics
from ._replay import Parting, Replay, replay
from .controller import Config, Controller, Output, Snapshot
from .messages import Message, evidence_names, message, reason_names
from .report import Results, read_results
from .trace import Trace, TraceError
from .wrap import Object, Poses, Run, Step, Task, Wrapped, wrap

__all__ = [
    "Config",
    "Controller",
    "Message",
    "Object",
    "Output",
    "Parting",
    "Poses",
    "Replay",
    "Results",
    "Run",
    "Snapshot",
    "Step",
    "Task",
    "Trace",
    "TraceError",
    "Wrapped",
    "evidence_names",
    "kinematics",
    "message",
    "read_results",
    "reason_names",
    "replay",
    "wrap",
]
