"""Makes dino.onnx, a small random network with Grounding DINO's signature, and
dino.json, its boxes for a test image, computed with NumPy alone.

    pip install onnx numpy && python make_dino.py
"""

import json

import numpy as np
import onnx
from onnx import TensorProto as T
from onnx import helper as h
from onnx import numpy_helper as nh

Q, D, V, CAP = 12, 8, 10, 256
rng = np.random.default_rng(5)
W_BOX = (rng.normal(size=(3, Q * 4)) * 1.0).astype(np.float32)
B_BOX = (rng.normal(size=Q * 4) * 0.7 - 0.3).astype(np.float32)
W_QUERY = (rng.normal(size=(3, Q * D))).astype(np.float32)
B_QUERY = (rng.normal(size=Q * D)).astype(np.float32)
EMBED = (rng.normal(size=(V, D)) * 0.8).astype(np.float32)


def model():
    node = h.make_node
    const = {
        "w_box": W_BOX, "b_box": B_BOX, "w_query": W_QUERY, "b_query": B_QUERY, "embed": EMBED,
        "box_shape": np.array([1, Q, 4]), "query_shape": np.array([1, Q, D]),
        "cap": np.array([CAP]), "axis2": np.array([2]), "low": np.array(-50, np.float32),
        "zero": np.array(0, np.float32), "one": np.array([1]), "two": np.array([2]),
        "head": np.array([0, 0, 0, 0, 0]),
    }
    nodes = [
        node("ReduceMean", ["pixel_values"], ["mean"], axes=[2, 3], keepdims=0),
        node("Gemm", ["mean", "w_box", "b_box"], ["flat_box"]),
        node("Reshape", ["flat_box", "box_shape"], ["raw_box"]),
        node("Sigmoid", ["raw_box"], ["boxes0"]),
        node("Gemm", ["mean", "w_query", "b_query"], ["flat_query"]),
        node("Reshape", ["flat_query", "query_shape"], ["query"]),
        node("Gather", ["embed", "input_ids"], ["text"], axis=0),
        node("Transpose", ["text"], ["text_t"], perm=[0, 2, 1]),
        node("MatMul", ["query", "text_t"], ["scores"]),
        node("Shape", ["input_ids"], ["shape"]),
        node("Slice", ["shape", "one", "two"], ["count"]),
        node("Sub", ["cap", "count"], ["rest"]),
        node("Concat", ["head", "rest"], ["pads"], axis=0),
        node("Pad", ["scores", "pads", "low"], ["logits0"]),
        # The masks take part, with no weight.
        node("Cast", ["pixel_mask"], ["m1"], to=T.FLOAT),
        node("Cast", ["attention_mask"], ["m2"], to=T.FLOAT),
        node("Cast", ["token_type_ids"], ["m3"], to=T.FLOAT),
        node("ReduceMean", ["m1"], ["r1"], keepdims=0),
        node("ReduceMean", ["m2"], ["r2"], keepdims=0),
        node("ReduceMean", ["m3"], ["r3"], keepdims=0),
        node("Mul", ["r1", "zero"], ["z1"]),
        node("Mul", ["r2", "zero"], ["z2"]),
        node("Mul", ["r3", "zero"], ["z3"]),
        node("Sum", ["z1", "z2", "z3"], ["z"]),
        node("Add", ["logits0", "z"], ["logits"]),
        node("Add", ["boxes0", "z"], ["pred_boxes"]),
    ]
    i64 = lambda name, *shape: h.make_tensor_value_info(name, T.INT64, shape)
    f32 = lambda name, *shape: h.make_tensor_value_info(name, T.FLOAT, shape)
    graph = h.make_graph(
        nodes, "dino",
        [f32("pixel_values", 1, 3, "h", "w"), i64("pixel_mask", 1, "h", "w"),
         i64("input_ids", 1, "t"), i64("token_type_ids", 1, "t"), i64("attention_mask", 1, "t")],
        [f32("logits", 1, Q, CAP), f32("pred_boxes", 1, Q, 4)],
        [nh.from_array(value, name) for name, value in const.items()],
    )
    made = h.make_model(graph, opset_imports=[h.make_opsetid("", 13)], ir_version=8)
    onnx.checker.check_model(made)
    return made


def image():
    y, x = np.mgrid[0:32, 0:48]
    return np.stack([x * 5 % 256, y * 7 % 256, (x + y) * 3 % 256], axis=-1).astype(np.uint8)


def expected():
    rgb = image().astype(np.float64) / 255
    rgb = (rgb - [0.485, 0.456, 0.406]) / [0.229, 0.224, 0.225]
    mean = rgb.mean(axis=(0, 1))
    boxes = 1 / (1 + np.exp(-(mean @ W_BOX + B_BOX).reshape(Q, 4)))
    query = (mean @ W_QUERY + B_QUERY).reshape(Q, D)
    # [CLS] black bowl . ram ##ek ##in . [SEP]
    ids, names = [2, 5, 6, 4, 7, 8, 9, 4, 3], [None, 0, 0, None, 1, 1, 1, None, None]
    score = 1 / (1 + np.exp(-(query @ EMBED[ids].T)))
    found = []
    for q in range(Q):
        named = [(score[q, i], n) for i, n in enumerate(names) if n is not None]
        best, name = max(named)
        x, y, w, hh = boxes[q]
        found.append({
            "label": ["black bowl", "ramekin"][name], "confidence": float(best),
            "box_px": [float(v) for v in
                       ((x - w / 2) * 48, (y - hh / 2) * 32, w * 48, hh * 32)],
        })
    return sorted((f for f in found if f["confidence"] > 0.3), key=lambda f: -f["confidence"])


onnx.save(model(), "dino.onnx")
with open("dino.json", "w") as file:
    json.dump(expected(), file, indent=1)
    file.write("\n")
with open("vocab.txt", "w") as file:
    file.write("\n".join("[PAD] [UNK] [CLS] [SEP] . black bowl ram ##ek ##in".split()) + "\n")
