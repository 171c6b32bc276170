"""Asks a policy server by openpi's own client (PyPI's openpi-client).

Usage: openpi_client_asks.py PORT answer|error; prints what came.
"""

import sys

import numpy as np
from openpi_client.websocket_client_policy import WebsocketClientPolicy

policy = WebsocketClientPolicy("127.0.0.1", int(sys.argv[1]))
observation = {
    "observation/image": np.full((224, 224, 3), 7, np.uint8),
    "observation/wrist_image": np.full((224, 224, 3), 9, np.uint8),
    "observation/state": np.array([0.25, 0.0, 0.5, 3.0, 0.0, 0.0, 0.04, -0.04]),
    "prompt": "put the can on the plate",
}
try:
    answer = policy.infer(observation)
except RuntimeError as error:
    print(error)
    sys.exit(sys.argv[2] != "error")
actions = answer["actions"]
print(
    policy.get_server_metadata()["model"], actions.shape, actions[3, 0],
    round(float(actions[9, 2]), 6), actions[0, 6], answer["server_timing"]["infer_ms"],
)
sys.exit(sys.argv[2] != "answer")
