"""Feeds recorded inputs to fitmac.Controller; writes its answers, byte for byte.

Usage: replay.py INPUTS OUTPUTS; the records are those of fitmac-capi's replay.cpp.
"""

import pathlib
import struct
import sys

import fitmac
from fitmac.messages import DTYPES

TOLD = {"state": "StateSample", "chunk": "ActionChunk", "grounding": "GroundingRecord",
        "plan": "Plan", "verifier": "VerifierReport", "critic": "CriticReport"}
REQUESTS = ("none", "stop", "reset")

data = pathlib.Path(sys.argv[1]).read_bytes()
controller, answers, at, ticks = fitmac.Controller(), [], 0, 0
while at < len(data):
    now_ns, request, contents = struct.unpack_from("=3Q", data, at)
    at += 24
    told = {}
    for bit, (argument, name) in enumerate(TOLD.items()):
        if contents >> bit & 1:
            end = at + DTYPES[name].itemsize
            told[argument] = fitmac.Message(name, data[at:end])
            at = end
    output = controller.tick(now_ns, request=REQUESTS[request], **told)
    if ticks % 100 == 0:  # a snapshot and its return change nothing
        controller.restore(controller.snapshot())
    ticks += 1
    rest = (output.query, output.rebind, output.trace, output.event)
    announced = sum(1 << bit for bit, m in enumerate(rest) if m is not None)
    answers.append(struct.pack("=Q", announced) + output.command.to_bytes())
    answers.extend(m.to_bytes() for m in rest if m is not None)
pathlib.Path(sys.argv[2]).write_bytes(b"".join(answers))
print(f"ticks {ticks}")
