"""Replays a recorded trace. Usage: replay_trace.py FILE [KEY=INTEGER ...]

Prints ticks, differing ticks, the first difference and the first differing decision.
"""

import sys

import fitmac

path, *settings = sys.argv[1:]
what_if = {key: int(value) for key, value in (setting.split("=") for setting in settings)}
found = fitmac.replay(path, what_if)
print(found.ticks, found.different_ticks, found.stopped)
for parting in (found.first, found.first_decision):
    print("-" if parting is None else f"{parting.tick} {parting.message}.{parting.field}")
