"""FIT-MAC: runtime assurance for robots that run a vision-language-action policy.

`wrap(policy, env, ...)` puts it around a policy and an environment;
`Controller` is the decision core itself, one tick at a time. Units are SI,
positions are in the robot's base frame, quaternions are (w, x, y, z), times are
nanoseconds. FIT-MAC is not a safety function.
"""

from ._fitmac import panda_forward, panda_jacobian
from .controller import Config, Controller, Output, Snapshot
from .messages import Message, evidence_names, message, reason_names
from .wrap import Object, Poses, Run, Step, Task, Wrapped, wrap

__all__ = [
    "Config",
    "Controller",
    "Message",
    "Object",
    "Output",
    "Poses",
    "Run",
    "Snapshot",
    "Step",
    "Task",
    "Wrapped",
    "evidence_names",
    "message",
    "panda_forward",
    "panda_jacobian",
    "reason_names",
    "wrap",
]
