"""Checks the ONNX file of a policy, which may be untrusted: operators, sizes and cost.

onnxruntime limits neither time nor memory, and reads other files, so KBot checks the graph first. A graph
that passes needs the same short time and the same little memory in every call, because it has neither loops
nor sizes that depend on numbers. `read_network` checks it in another process, with limits: the libraries that
read a malformed file are written in C++, and may end their process.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kbot.text import KbotError
from kbot.text.extras import needs_extra
from kbot.worker.worker import LimitExceeded, Worker, WorkerLimits

if TYPE_CHECKING:
    from google.protobuf.message import Message
    from onnx import GraphProto, ModelProto, NodeProto, TensorProto, ValueInfoProto

MOST_BYTES = 32 * 1024 * 1024
"""Size of the largest file. A network with two layers of 256 neurons has 0.4 MB."""
MOST_METADATA = 64 * 1024
"""Bytes of the texts that the file's author added. The description of the inputs has less than 1 kB."""
MOST_NODES = 2000
"""Operators of the largest network. One with two layers has about ten."""
MOST_ELEMENTS = 1_000_000
"""Numbers in one tensor between two operators."""
MOST_WORK = 50_000_000
"""Multiplications of one call. They take about 20 ms on a slow processor."""
_FUNCTION = 10
"""An operator like an exponential takes as long as this many multiplications for each number. So the tensors
of a call have at most a tenth of `MOST_WORK` numbers together."""
_RANDOM_INPUTS = 20
"""Random inputs with which the check runs a network, besides extreme ones."""
_FLOATS = (1, 10, 11)
"""Numbers of the types float32, float16 and float64 in ONNX."""
LIMITS = WorkerLimits(seconds=20.0, memory=1_500_000_000)
"""For the check. It takes about a second and 200 MB, nearly all of it for loading the libraries."""
_LONGEST_SHOWN = 200
"""Characters of a library's error that are shown."""

_NAMES = """
    Abs Add And ArgMax ArgMin AveragePool BatchNormalization Cast Ceil Clip Concat Constant Conv Cos Div
    Elu Equal Erf Exp Flatten Floor Gather Gelu Gemm GlobalAveragePool GlobalMaxPool Greater
    GreaterOrEqual HardSigmoid HardSwish Identity LayerNormalization LeakyRelu Less LessOrEqual Log
    LogSoftmax MatMul Max MaxPool Mean Min Mish Mul Neg Not Or PRelu Pow Reciprocal ReduceL2 ReduceMax
    ReduceMean ReduceMin ReduceSum Relu Reshape Round Selu Shape Sigmoid Sign Sin Slice Softmax Softplus
    Softsign Split Sqrt Squeeze Sub Sum Swish Tanh Transpose Unsqueeze Where
"""
OPERATORS = frozenset(_NAMES.split())
"""Operators of feed-forward networks. They do not include operators that run a graph again (Loop,
Scan, If), draw random numbers, make tensors of any size (Expand, Tile, Pad, Resize), or take time that
depends on numbers."""


@dataclass(frozen=True, slots=True)
class Network:
    """A checked network.

    data      the ONNX model, for one call at a time
    input     the name of its input, which has the shape (1, `inputs`) and the type float32
    inputs    numbers that it gets
    outputs   numbers that it returns, in a tensor of the shape (1, `outputs`) and the type float32
    metadata  the texts that the file's author added, by key
    """

    data: bytes
    input: str
    inputs: int
    outputs: int
    metadata: Mapping[str, str]


def read_network(data: bytes) -> Network:
    """Check the bytes of an ONNX file.

    Raises: KbotError: they are not a network, or it may not be run. The text begins with a verb, for a
    sentence about the file."""
    worker = Worker()
    worker.limits = LIMITS
    try:
        return worker.call(check, data)
    except LimitExceeded as error:
        raise KbotError(f"cannot be checked: the check {error}") from None
    finally:
        worker.end()


def open_session(data: bytes) -> Any:  # noqa: ANN401 - onnxruntime has no types
    """A session that runs a model on one thread, and gives equal results for equal inputs.

    Raises: KbotError: it cannot be run, or onnxruntime is not installed."""
    onnxruntime = _library("onnxruntime")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.use_deterministic_compute = True
    options.log_severity_level = 4  # its errors are raised too
    # not "session.set_denormal_as_zero", which would change the arithmetic of the thread, and so the physics
    try:
        return onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # noqa: BLE001 - onnxruntime's own have no base class
        raise KbotError(f"cannot be run: {_first_line(error)}") from None


def with_metadata(data: bytes, texts: Mapping[str, str]) -> bytes:
    """The bytes of an ONNX file with more texts in its metadata.

    The notes of exporters about operators and tensors are removed. PyTorch writes source code and the paths
    of its files there.

    Raises: KbotError: they are not an ONNX file, or onnx is not installed."""
    model = _parsed(data)
    graph = model.graph
    for part in (graph, *graph.node, *graph.initializer, *graph.input, *graph.output, *graph.value_info):
        part.ClearField("metadata_props")
        part.ClearField("doc_string")
    kept = [each for each in model.metadata_props if each.key not in texts]
    del model.metadata_props[:]
    model.metadata_props.extend(kept)
    for key, value in texts.items():
        model.metadata_props.add(key=key, value=value)
    described: bytes = model.SerializeToString()
    return described


def check(data: bytes) -> Network:
    """What `read_network` does, in this process. Raises KbotError in the same cases."""
    model = _parsed(data)
    graph = model.graph
    if sum(each.ByteSize() for each in model.metadata_props) > MOST_METADATA:
        raise KbotError(f"has more than {MOST_METADATA // 1024} kB of metadata")
    _check_operators(model)
    _check_tensors(graph, len(data))
    known = {tensor.name for tensor in graph.initializer}
    given = [each for each in graph.input if each.name not in known]
    entry, inputs = _vector("input", given)
    _, outputs = _vector("output", list(graph.output))
    _check_cost(model)
    fixed = model.SerializeToString()
    network = Network(fixed, entry, inputs, outputs, {each.key: each.value for each in model.metadata_props})
    session = open_session(fixed)
    for seen in _extremes(inputs):
        run(session, network, seen)
    return network


def run(session: Any, network: Network, seen: NDArray[np.float32]) -> NDArray[np.float32]:  # noqa: ANN401
    """The numbers that a network in a session returns for those that it gets.

    Raises: KbotError: it cannot be run, or returns something else than it declares."""
    try:
        found: NDArray[np.float32] = session.run(None, {network.input: seen[None]})[0]
    except Exception as error:  # noqa: BLE001 - onnxruntime's own have no base class
        raise KbotError(f"cannot be run: {_first_line(error)}") from None
    if found.shape != (1, network.outputs) or found.dtype != np.float32:
        raise KbotError(
            f"returns {found.dtype} of the shape {found.shape}, not float32 of (1, {network.outputs})"
        )
    numbers: NDArray[np.float32] = found[0]
    return numbers


def _extremes(count: int) -> Iterator[NDArray[np.float32]]:
    """Inputs with which an operator might end the process."""
    random = np.random.default_rng(0)
    for value in (0.0, 1e30, -1e30, math.nan, math.inf):
        yield np.full(count, value, np.float32)
    for _ in range(_RANDOM_INPUTS):
        yield random.normal(0.0, 10.0, count).astype(np.float32)


def _library(name: str) -> Any:  # noqa: ANN401 - a module
    from importlib import import_module

    try:
        return import_module(name)  # an extra
    except ModuleNotFoundError:
        raise KbotError(needs_extra("a policy", "policy")) from None


def _parsed(data: bytes) -> ModelProto:
    onnx = _library("onnx")
    from google.protobuf.message import DecodeError  # protobuf comes with onnx

    try:
        model: ModelProto = onnx.ModelProto.FromString(data)
    except DecodeError:
        raise KbotError("is not an ONNX file") from None
    if not (model.ir_version and model.graph.node and model.opset_import and _is_text(model)):
        raise KbotError("is not an ONNX file")
    return model


def _is_text(message: Message) -> bool:
    """Whether all names in a message are UTF-8. Others are read as bytes."""
    for field, value in message.ListFields():
        if field.type in (field.TYPE_STRING, field.TYPE_MESSAGE):
            is_single = isinstance(value, str | bytes) or hasattr(value, "ListFields")
            for each in [value] if is_single else value:
                if isinstance(each, bytes) or not (isinstance(each, str) or _is_text(each)):
                    return False
    return True


def _check_operators(model: ModelProto) -> None:
    if len(model.graph.node) > MOST_NODES:
        raise KbotError(f"has {len(model.graph.node)} operators, more than {MOST_NODES}")
    if model.functions:
        raise KbotError("defines functions. Write their operators into the graph with onnx.inliner")
    for node in model.graph.node:
        domain = "" if node.domain in ("", "ai.onnx") else f"{node.domain}."
        if domain or node.op_type not in OPERATORS:
            raise KbotError(
                f"uses the operator {_shown(domain + node.op_type)}, which a policy must not use. It may use"
                " the operators of feed-forward networks, without loops and memory"
            )
        if any(each.HasField("g") or each.graphs for each in node.attribute):
            raise KbotError(f"has a graph inside the operator {node.op_type}, which a policy must not have")


def _check_tensors(graph: GraphProto, file_bytes: int) -> None:
    if graph.sparse_initializer:
        raise KbotError("has sparse tensors, which a policy must not have")
    for tensor in _tensors(graph):
        if tensor.data_location == tensor.EXTERNAL or tensor.external_data:
            raise KbotError(
                f"keeps the tensor {_shown(tensor.name)} in another file. Export it into one file, for"
                " example with external_data=False in torch.onnx.export"
            )
        # no type is smaller than half a byte
        if min(tensor.dims, default=0) < 0 or math.prod(tensor.dims) > 2 * file_bytes:
            raise KbotError(f"has a tensor {_shown(tensor.name)} that is larger than the file")


def _tensors(graph: GraphProto) -> Iterator[TensorProto]:
    yield from graph.initializer
    for node in graph.node:
        for each in node.attribute:
            if each.HasField("sparse_tensor") or each.sparse_tensors:
                raise KbotError("has sparse tensors, which a policy must not have")
            if each.HasField("t"):
                yield each.t
            yield from each.tensors


def _vector(what: str, values: list[ValueInfoProto]) -> tuple[str, int]:
    """The name and the length of the only input or output. Its batch is fixed at 1 in the model."""
    from onnx import TensorProto

    if len(values) != 1:
        names = f": {', '.join(_shown(each.name) for each in values[:5])}" if values else ""
        raise KbotError(f"has {len(values)} {what}s{names}. A policy has one {what}")
    (value,) = values
    kind = value.type.tensor_type
    dims = list(kind.shape.dim)
    if (
        kind.elem_type != TensorProto.FLOAT
        or len(dims) != 2
        or (dims[0].HasField("dim_value") and dims[0].dim_value != 1)
    ):
        raise KbotError(f"has the {what} {_shown(value.name)} that is not float32 of the shape (1, n)")
    if not 0 < dims[1].dim_value <= MOST_ELEMENTS:
        raise KbotError(f"has the {what} {_shown(value.name)} without a fixed length")
    dims[0].Clear()
    dims[0].dim_value = 1
    return value.name, dims[1].dim_value


def _check_cost(model: ModelProto) -> None:
    """Infer all sizes, and add up the multiplications of a call."""
    from onnx import shape_inference

    del model.graph.value_info[:]  # what the file claims
    try:
        inferred = shape_inference.infer_shapes(model, check_type=True, strict_mode=True, data_prop=True)
    except Exception as error:  # noqa: BLE001 - onnx raises several types without a base class
        raise KbotError(f"has operators that do not fit together: {_first_line(error)}") from None
    graph = inferred.graph
    shapes = {tensor.name: tuple(tensor.dims) for tensor in graph.initializer}
    types = {}
    for each in (*graph.input, *graph.value_info, *graph.output):
        shapes[each.name], types[each.name] = _shape_of(each), each.type.tensor_type.elem_type
    work = 0
    for node in graph.node:
        for name in filter(None, node.output):
            size = _elements(shapes.get(name, (-1,)))
            if size < 0:
                raise KbotError(f"has the tensor {_shown(name)} whose size depends on numbers")
            if size > MOST_ELEMENTS:
                raise KbotError(f"has the tensor {_shown(name)} of more than {MOST_ELEMENTS:,} numbers")
        if node.op_type == "Div" and types.get(node.output[0]) not in _FLOATS:
            raise KbotError(
                "divides integers, which a policy must not do: a division by zero ends the process"
            )
        work += _work(node, shapes)
    if work > MOST_WORK:
        raise KbotError(f"needs more than {MOST_WORK:,} multiplications for one step")


def _shape_of(value: ValueInfoProto) -> tuple[int, ...]:
    """The sizes of a tensor. An unknown one is -1."""
    kind = value.type.tensor_type
    if not kind.HasField("shape"):
        return (-1,)
    return tuple(dim.dim_value if dim.HasField("dim_value") else -1 for dim in kind.shape.dim)


def _elements(shape: Iterable[int]) -> int:
    sizes = list(shape)
    return -1 if any(size < 0 for size in sizes) else math.prod(sizes)


def _work(node: NodeProto, shapes: Mapping[str, tuple[int, ...]]) -> int:
    """An upper bound of the multiplications of an operator."""
    of = [shapes.get(name, ()) for name in node.input]
    results = [shapes[name] for name in node.output if name]
    largest = max((abs(_elements(each)) for each in (*of, *results)), default=0)
    if not results:
        return _FUNCTION * largest
    result = _elements(results[0])
    if node.op_type in ("Gemm", "MatMul") and of[0]:
        inner = of[0][0] if _attribute(node, "transA") else of[0][-1]
        return result * abs(inner)
    if node.op_type == "Conv" and len(of) > 1 and of[1]:
        return result * abs(math.prod(of[1][1:]))
    if node.op_type in ("AveragePool", "MaxPool"):
        kernel = next((each.ints for each in node.attribute if each.name == "kernel_shape"), ())
        return result * int(abs(math.prod(kernel)))
    return _FUNCTION * largest


def _attribute(node: NodeProto, name: str) -> int:
    return next((int(each.i) for each in node.attribute if each.name == name), 0)


def _shown(name: str) -> str:
    """A name from the file, on one short line."""
    return repr(name if len(name) <= 60 else f"{name[:60]}…")


def _first_line(error: Exception) -> str:
    """The message of a library, on one short line."""
    text = re.sub(r"\s+", " ", str(error)).strip()
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…"
