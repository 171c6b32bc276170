"""A host in Python: the control loop of the benchmark `ffi`.

Usage: ffi_loop.py INPUTS; a line on standard input is one run through the
inputs, answered by a line. The records are now_ns, request, contents (u64
each) and the messages whose bits are set.
"""

import pathlib
import struct
import sys

import fitmac
from fitmac.messages import DTYPES

TOLD = {"state": "StateSample", "chunk": "ActionChunk", "grounding": "GroundingRecord",
        "plan": "Plan", "verifier": "VerifierReport", "critic": "CriticReport"}

data, at, steps = pathlib.Path(sys.argv[1]).read_bytes(), 0, []
while at < len(data):
    now_ns, _, contents = struct.unpack_from("=3Q", data, at)
    at += 24
    told = {}
    for bit, (argument, name) in enumerate(TOLD.items()):
        if contents >> bit & 1:
            end = at + DTYPES[name].itemsize
            told[argument] = fitmac.Message(name, data[at:end])
            at = end
    steps.append((now_ns, told))

print("ready", flush=True)
controller = fitmac.Controller()
for _ in sys.stdin:
    controller.reset()
    tick = controller.tick
    for now_ns, told in steps:
        tick(now_ns, **told)
    print("done", flush=True)
