"""Small networks as ONNX files, made by hand."""

from collections.abc import Mapping, Sequence

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

OPSET = 17
FLOAT = TensorProto.FLOAT


def model(
    nodes: Sequence[onnx.NodeProto],
    inputs: int = 3,
    outputs: int = 2,
    tensors: Mapping[str, NDArray[np.generic]] | None = None,
    batch: int | str = 1,
) -> onnx.ModelProto:
    """A model from `seen` (batch, inputs) to `action` (batch, outputs)."""
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("seen", FLOAT, [batch, inputs])],
        [helper.make_tensor_value_info("action", FLOAT, [batch, outputs])],
        [numpy_helper.from_array(value, name) for name, value in (tensors or {}).items()],
    )
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8)


def linear(weights: NDArray[np.float32], bias: NDArray[np.float32], *, clipped: bool = True) -> bytes:
    """action = clip(weights @ seen + bias, -1, 1)"""
    nodes = [helper.make_node("Gemm", ["seen", "w", "b"], ["sum" if clipped else "action"], transB=1)]
    tensors = {"w": weights.astype(np.float32), "b": bias.astype(np.float32)}
    if clipped:
        nodes.append(helper.make_node("Clip", ["sum", "low", "high"], ["action"]))
        tensors |= {"low": np.float32(-1.0), "high": np.float32(1.0)}
        tensors = {name: np.asarray(value, dtype=np.float32) for name, value in tensors.items()}
    outputs, inputs = weights.shape
    return model(nodes, inputs, outputs, tensors, "batch").SerializeToString()


def towards_goal(interface: object, speed: float = 0.0, gain: float = 2.0) -> bytes:
    """A policy that turns towards the goal, and drives at a constant number `speed` from -1 to 1."""
    names = [field.name for field in interface.inputs]
    weights = np.zeros((len(interface.actions), len(names)), np.float32)
    weights[1, names.index("goal_sin")] = gain
    bias = np.zeros(len(interface.actions), np.float32)
    bias[0] = speed
    return linear(weights, bias)
