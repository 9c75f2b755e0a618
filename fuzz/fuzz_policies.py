"""Fuzzes the check of policies, which are ONNX files.

Any bytes either give a network with known sizes, or one KbotError of one line. The libraries of the check may end its
process, which is one error too.
"""

import numpy as np
from choices import Choices
from edits import edited
from numpy.typing import NDArray
from onnx import NodeProto, TensorProto, helper, numpy_helper

from kbot.learn.policies.network import LIMITS, Network, check
from kbot.text import KbotError
from kbot.worker.worker import Worker

WORKER = Worker()
WORKER.limits = LIMITS


def network() -> bytes:
    """tanh(seen @ w + b), with a clip."""
    nodes = [
        helper.make_node("Gemm", ["seen", "w", "b"], ["sum"], transB=1),
        helper.make_node("Tanh", ["sum"], ["bounded"]),
        helper.make_node("Clip", ["bounded", "low", "high"], ["action"]),
    ]
    numbers = {"w": np.ones((2, 3)), "b": np.zeros(2), "low": np.array(-1.0), "high": np.array(1.0)}
    numbers = {name: value.astype(np.float32) for name, value in numbers.items()}
    return model(nodes, numbers)


def pooled() -> bytes:
    """The greatest of neighbouring numbers, with a padding at both ends."""
    nodes = [
        helper.make_node("Unsqueeze", ["seen", "axis"], ["row"]),
        helper.make_node("MaxPool", ["row"], ["greatest"], kernel_shape=[4], pads=[1, 1]),
        helper.make_node("Squeeze", ["greatest", "axis"], ["action"]),
    ]
    return model(nodes, {"axis": np.array([1])})


def model(nodes: list[NodeProto], numbers: dict[str, NDArray[np.generic]]) -> bytes:
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("seen", TensorProto.FLOAT, ["batch", 3])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, ["batch", 2])],
        [numpy_helper.from_array(value, name) for name, value in numbers.items()],
    )
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    helper.set_model_props(made, {"kbot_policy": "{}"})
    data: bytes = made.SerializeToString()
    return data


SEEDS = [network(), pooled()]
WORDS = [
    b"Loop", b"Exp\x00", b"Relu", b"Gemm", b"Div", b"Cast", b"Tanh", b"Clip", b"seen", b"batch", b"transB", b"MaxPool", b"pads",
    b"\xff\xff\xff\xff\x0f", b"\x80\x80\x80\x80\x80\x80\x80\x80\x80\x01", b"\x0a\x00", b"\x12\x00", b"\x08\x01",
]  # fmt: skip


def one_input(choices: Choices) -> None:
    data = edited(choices, SEEDS, WORDS)
    try:
        found: Network = WORKER.call(check, data)
    except KbotError as error:
        message = str(error)
    else:
        message = ""
        assert found.inputs > 0, found
        assert found.outputs > 0, found
    assert "\n" not in message, message


TARGETS = {"policies": one_input}
