"""Untrusted ONNX files of policies: what is not a plain network is refused with one sentence."""

import os
import re
from collections.abc import Callable

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from kbot.learn.policies import network
from kbot.learn.policies.network import check, open_session, read_network, with_metadata
from kbot.text import KbotError
from kbot.text.extras import needs_extra

from .networks import FLOAT, linear, model


def relu(**changes: object) -> onnx.ModelProto:
    """A model of one operator from 3 numbers to 3 numbers."""
    return model([helper.make_node("Relu", ["seen"], ["action"])], outputs=3, **changes)


def test_a_linear_network_gives_its_matrix_product() -> None:
    weights, bias = np.array([[0.1, 0.2, 0.3], [0.0, -0.5, 9.0]]), np.array([0.25, 0.5])
    found = read_network(with_metadata(linear(weights, bias), {"key": "text"}))
    assert (found.input, found.inputs, found.outputs) == ("seen", 3, 2)
    assert found.metadata == {"key": "text"}
    session = open_session(found.data)
    seen = np.array([[1.0, 2.0, -1.0]], np.float32)
    # 0.1 + 0.4 - 0.3 + 0.25 = 0.45, and -1 - 9 + 0.5, which is clipped
    assert session.run(None, {"seen": seen})[0][0] == pytest.approx([0.45, -1.0])
    first = session.run(None, {"seen": seen})[0]
    assert all((session.run(None, {"seen": seen})[0] == first).all() for _ in range(20))


def test_a_session_leaves_the_arithmetic_of_its_thread_unchanged() -> None:
    half, smallest_normal = float("0.5"), 2.0**-1022
    open_session(linear(np.eye(2, dtype=np.float32), np.zeros(2, np.float32)))
    assert half * smallest_normal > 0.0


def test_the_batch_is_fixed_at_one() -> None:
    found = read_network(linear(np.ones((2, 3)), np.zeros(2)))
    (value,) = onnx.ModelProto.FromString(found.data).graph.input
    assert [dim.dim_value for dim in value.type.tensor_type.shape.dim] == [1, 3]


def test_metadata_replaces_an_earlier_text() -> None:
    data = linear(np.ones((2, 3)), np.zeros(2))
    twice = with_metadata(with_metadata(data, {"a": "1", "b": "2"}), {"a": "3"})
    assert check(twice).metadata == {"a": "3", "b": "2"}


def test_long_metadata_is_refused() -> None:
    data = linear(np.ones((2, 3)), np.zeros(2))
    check(with_metadata(data, {"a": "x" * 65_000}))
    for texts in ({"a": "x" * 66_000}, {"x" * 66_000: "a"}, {f"key{n}": "x" * 100 for n in range(1000)}):
        with pytest.raises(KbotError, match=r"^has more than 64 kB of metadata$"):
            check(with_metadata(data, texts))


def test_notes_of_exporters_are_removed() -> None:
    """PyTorch writes its source code and the paths of its files into each operator."""
    noted = relu()
    noted.graph.node[0].doc_string = 'File "/home/me/secret.py", line 1'
    for part in (noted.graph, noted.graph.node[0], noted.graph.input[0]):
        part.metadata_props.add(key="pkg.torch.onnx.stack_trace", value='File "/home/me/secret.py", line 1')
    noted.metadata_props.add(key="author", value="me")
    data = noted.SerializeToString()
    assert b"secret" in data
    described = with_metadata(data, {"key": "text"})
    assert b"secret" not in described
    assert check(described).metadata == {"author": "me", "key": "text"}


@pytest.mark.parametrize("data", [b"", b"\n", b"<robot/>", b"\x08\x07", bytes(range(256)) * 40])
def test_other_files_are_no_onnx_files(data: bytes) -> None:
    with pytest.raises(KbotError, match=r"^is not an ONNX file$"):
        check(data)


def test_names_that_are_not_utf_8_are_refused() -> None:
    data = relu().SerializeToString()
    for name in (b"Relu", b"seen", b"policy"):
        with pytest.raises(KbotError, match=r"^is not an ONNX file$"):
            check(data.replace(name, b"\xff" + name[1:]))


def test_a_truncated_file_is_refused() -> None:
    data = linear(np.ones((2, 3)), np.zeros(2))
    for size in range(0, len(data), 7):
        with pytest.raises(KbotError):
            check(data[:size])


def external(file: str) -> onnx.ModelProto:
    found = model([helper.make_node("MatMul", ["seen", "w"], ["action"])])
    tensor = TensorProto(name="w", data_type=FLOAT, dims=[3, 2], data_location=TensorProto.EXTERNAL)
    tensor.external_data.add(key="location", value=file)
    found.graph.initializer.append(tensor)
    return found


def external_constant(file: str) -> onnx.ModelProto:
    (tensor,) = external(file).graph.initializer
    nodes = [
        helper.make_node("Constant", [], ["w"], value=tensor),
        helper.make_node("MatMul", ["seen", "w"], ["action"]),
    ]
    return model(nodes)


@pytest.mark.parametrize("make", [external, external_constant])
@pytest.mark.parametrize("file", ["weights.bin", "../../etc/passwd", "/etc/passwd"])
def test_tensors_in_other_files_are_refused(make: Callable[[str], onnx.ModelProto], file: str) -> None:
    with pytest.raises(KbotError, match="keeps the tensor 'w' in another file"):
        check(make(file).SerializeToString())


def loop() -> onnx.ModelProto:
    """Repeats for ever."""
    value = helper.make_tensor_value_info
    body = helper.make_graph(
        [
            helper.make_node("Identity", ["go_on"], ["go_on_out"]),
            helper.make_node("Identity", ["x"], ["x_out"]),
        ],
        "body",
        [value("i", TensorProto.INT64, []), value("go_on", TensorProto.BOOL, []), value("x", FLOAT, [1, 3])],
        [value("go_on_out", TensorProto.BOOL, []), value("x_out", FLOAT, [1, 3])],
    )
    node = helper.make_node("Loop", ["", "yes", "seen"], ["action"], body=body)
    return model([node], outputs=3, tensors={"yes": np.array(True)})


def foreign() -> onnx.ModelProto:
    found = model([helper.make_node("Relu", ["seen"], ["action"], domain="com.example")], outputs=3)
    found.opset_import.append(helper.make_opsetid("com.example", 1))
    return found


def functions() -> onnx.ModelProto:
    found = relu()
    node = helper.make_node("Relu", ["x"], ["y"])
    found.functions.append(
        helper.make_function("example", "F", ["x"], ["y"], [node], [helper.make_opsetid("", 17)])
    )
    return found


def hidden_graph() -> onnx.ModelProto:
    found = relu()
    (body,) = (each.g for each in loop().graph.node[0].attribute)
    found.graph.node[0].attribute.append(helper.make_attribute("body", body))
    return found


def random_numbers() -> onnx.ModelProto:
    return model([helper.make_node("RandomNormalLike", ["seen"], ["action"])], outputs=3)


def huge_tensor() -> onnx.ModelProto:
    """Eight numbers that become 2^40."""
    nodes = [
        helper.make_node("ConstantOfShape", ["shape"], ["x"]),
        helper.make_node("ReduceSum", ["x"], ["action"]),
    ]
    return model(nodes, tensors={"shape": np.array([1 << 20, 1 << 20])})


def growing() -> onnx.ModelProto:
    """Every operator doubles the length."""
    nodes = [
        helper.make_node("Concat", [a, a], [f"{a}x"], axis=1) for a in ("seen" + "x" * n for n in range(30))
    ]
    nodes.append(helper.make_node("ReduceMax", ["seen" + "x" * 30], ["action"], axes=[1]))
    return model(nodes, outputs=1)


def outer_product() -> onnx.ModelProto:
    """(1, 3000) and (3000, 1) become nine million numbers."""
    nodes = [
        helper.make_node("Transpose", ["seen"], ["column"]),
        helper.make_node("Mul", ["seen", "column"], ["square"]),
        helper.make_node("ReduceMax", ["square"], ["most"], keepdims=1),
    ]
    nodes.append(helper.make_node("Identity", ["most"], ["action"]))
    return model(nodes, 3000, 1)


def pooled(**attributes: object) -> onnx.ModelProto:
    """A pooling of one number, in 18 dimensions."""
    nodes = [
        helper.make_node("ReduceMax", ["seen"], ["most"], keepdims=1),
        helper.make_node("Reshape", ["most", "shape"], ["x"]),
        helper.make_node("MaxPool", ["x"], ["y"], **attributes),
        helper.make_node("ReduceMax", ["y"], ["top"], keepdims=0),
        helper.make_node("Mul", ["seen", "top"], ["action"]),
    ]
    return model(nodes, outputs=3, tensors={"shape": np.full(20, 1)})


def wide_padding() -> onnx.ModelProto:
    return pooled(kernel_shape=[1] * 18, pads=[2**61] * 36)


def wide_kernel() -> onnx.ModelProto:
    return pooled(kernel_shape=[2**62] * 18, auto_pad="SAME_UPPER")


def slow() -> onnx.ModelProto:
    """300 products of matrices of 900 x 900: 2e11 multiplications in a file of 3 MB."""
    nodes = [helper.make_node("MatMul", ["w", "w"], ["x0"])]
    nodes += [helper.make_node("MatMul", [f"x{n}", "w"], [f"x{n + 1}"]) for n in range(300)]
    nodes += [
        helper.make_node("ReduceMax", ["x300"], ["most"]),
        helper.make_node("Mul", ["seen", "most"], ["action"]),
    ]
    return model(nodes, outputs=3, tensors={"w": np.zeros((900, 900), np.float32)})


def many_functions() -> onnx.ModelProto:
    """1999 times a million exponentials."""
    nodes = [helper.make_node("Exp", ["w"], ["x0"])]
    nodes += [helper.make_node("Exp", [f"x{n}"], [f"x{n + 1}"]) for n in range(100)]
    nodes += [
        helper.make_node("ReduceMax", ["x100"], ["most"]),
        helper.make_node("Mul", ["seen", "most"], ["action"]),
    ]
    return model(nodes, outputs=3, tensors={"w": np.zeros((1000, 900), np.float32)})


def many_operators() -> onnx.ModelProto:
    nodes = [helper.make_node("Relu", ["seen" if n == 0 else f"x{n}"], [f"x{n + 1}"]) for n in range(2000)]
    return model([*nodes, helper.make_node("Relu", ["x2000"], ["action"])], outputs=3)


def claimed_size() -> onnx.ModelProto:
    found = model([helper.make_node("MatMul", ["seen", "w"], ["action"])])
    found.graph.initializer.append(TensorProto(name="w", data_type=FLOAT, dims=[3, 1 << 50]))
    return found


def negative_size() -> onnx.ModelProto:
    found = model([helper.make_node("MatMul", ["seen", "w"], ["action"])])
    found.graph.initializer.append(TensorProto(name="w", data_type=FLOAT, dims=[3, -2]))
    return found


def sparse() -> onnx.ModelProto:
    found = relu()
    found.graph.sparse_initializer.add(dims=[1 << 40])
    return found


def two_inputs() -> onnx.ModelProto:
    found = relu()
    found.graph.input.append(helper.make_tensor_value_info("more", FLOAT, [1, 3]))
    return found


def no_output() -> onnx.ModelProto:
    found = relu()
    del found.graph.output[:]
    return found


def wide_batch() -> onnx.ModelProto:
    return relu(batch=4)


def double() -> onnx.ModelProto:
    found = relu()
    found.graph.input[0].type.tensor_type.elem_type = TensorProto.DOUBLE
    return found


def any_length() -> onnx.ModelProto:
    found = relu()
    found.graph.input[0].type.tensor_type.shape.dim[1].dim_param = "n"
    return found


def numbers_as_size() -> onnx.ModelProto:
    """The seen numbers are a shape."""
    nodes = [
        helper.make_node("Cast", ["seen"], ["whole"], to=TensorProto.INT64),
        helper.make_node("Reshape", ["whole", "flat"], ["shape"]),
        helper.make_node("Reshape", ["seen", "shape"], ["x"]),
        helper.make_node("ReduceMax", ["x"], ["most"], keepdims=0),
        helper.make_node("Mul", ["seen", "most"], ["action"]),
    ]
    return model(nodes, outputs=3, tensors={"flat": np.array([3])})


def mismatched() -> onnx.ModelProto:
    nodes = [helper.make_node("MatMul", ["seen", "w"], ["action"])]
    return model(nodes, tensors={"w": np.zeros((5, 2), np.float32)})


def wrong_claim() -> onnx.ModelProto:
    return model([helper.make_node("Relu", ["seen"], ["action"])], outputs=2)


def cycle() -> onnx.ModelProto:
    nodes = [helper.make_node("Relu", ["b"], ["a"]), helper.make_node("Relu", ["a"], ["b"])]
    return model([*nodes, helper.make_node("Add", ["seen", "b"], ["action"])], outputs=3)


def unknown_name() -> onnx.ModelProto:
    return model([helper.make_node("Relu", ["nothing"], ["action"])], outputs=3)


def integer_division() -> onnx.ModelProto:
    """Ends the process if a seen number is between 5 and 6."""
    nodes = [
        helper.make_node("Cast", ["seen"], ["whole"], to=TensorProto.INT64),
        helper.make_node("Sub", ["whole", "five"], ["difference"]),
        helper.make_node("Div", ["five", "difference"], ["quotient"]),
        helper.make_node("Cast", ["quotient"], ["action"], to=FLOAT),
    ]
    return model(nodes, outputs=3, tensors={"five": np.array([5])})


def index() -> onnx.ModelProto:
    """The seen numbers are indices, which are out of range in general."""
    nodes = [
        helper.make_node("Cast", ["seen"], ["whole"], to=TensorProto.INT64),
        helper.make_node("Gather", ["w", "whole"], ["action"]),
    ]
    return model(nodes, outputs=3, tensors={"w": np.zeros(2, np.float32)})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (integer_division, "divides integers"),
        (index, "cannot be run: .*Gather"),
        (loop, "uses the operator 'Loop', which a policy must not use"),
        (foreign, "uses the operator 'com.example.Relu'"),
        (functions, "defines functions"),
        (hidden_graph, "has a graph inside the operator Relu"),
        (random_numbers, "uses the operator 'RandomNormalLike'"),
        (huge_tensor, "uses the operator 'ConstantOfShape'"),
        (growing, "has the tensor .* of more than 1,000,000 numbers$"),
        (outer_product, "has the tensor 'square' of more than 1,000,000 numbers$"),
        (wide_padding, "has the tensor 'y' of more than 1,000,000 numbers$"),
        (wide_kernel, "needs more than 50,000,000 multiplications for one step$"),
        (slow, "needs more than 50,000,000 multiplications for one step$"),
        (many_functions, "needs more than 50,000,000 multiplications for one step$"),
        (many_operators, "has 2001 operators, more than 2000"),
        (claimed_size, "has a tensor 'w' that is larger than the file"),
        (negative_size, "has a tensor 'w' that is larger than the file"),
        (sparse, "has sparse tensors"),
        (two_inputs, "has 2 inputs: 'seen', 'more'. A policy has one input"),
        (no_output, "has 0 outputs. A policy has one output"),
        (wide_batch, r"has the input 'seen' that is not float32 of the shape \(1, n\)"),
        (double, "has the input 'seen' that is not float32"),
        (any_length, "has the input 'seen' without a fixed length"),
        (numbers_as_size, "whose size depends on numbers"),
        (mismatched, "has operators that do not fit together: "),
        (wrong_claim, "has operators that do not fit together: "),
        (cycle, "has operators that do not fit together: |cannot be run: "),
        (unknown_name, "has operators that do not fit together: |whose size|cannot be run: "),
    ],
)
def test_a_hostile_file_is_refused(make: Callable[[], onnx.ModelProto], message: str) -> None:
    with pytest.raises(KbotError, match=message) as caught:
        check(make().SerializeToString())
    assert "\n" not in str(caught.value)


def test_a_network_that_ends_the_process_of_onnxruntime_is_one_error() -> None:
    """Version 1.32 of onnxruntime reads the missing input of a mean."""
    data = model([helper.make_node("Mean", ["seen", "", "seen"], ["action"])], outputs=3).SerializeToString()
    with pytest.raises(KbotError, match=r"^(cannot be|has operators that do not fit)"):
        read_network(data)


def test_a_check_that_ends_its_process_is_one_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(network, "check", os._exit)
    with pytest.raises(KbotError, match=r"^cannot be checked: the check ended its process, with status 3$"):
        read_network(3)  # type: ignore[arg-type]


def test_a_check_that_needs_too_much_memory_is_one_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """The libraries alone need more than 30 MB."""
    monkeypatch.setattr(network, "LIMITS", network.WorkerLimits(seconds=60.0, memory=30_000_000))
    with pytest.raises(KbotError, match=r"^cannot be checked: the check took more than 0\.03 GB of memory"):
        read_network(linear(np.ones((2, 3)), np.zeros(2)))


def test_a_missing_library_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "onnx", None)
    with pytest.raises(KbotError, match=re.escape(needs_extra("a policy", "policy"))):
        check(b"")


def test_networks_as_torch_exports_them_are_accepted() -> None:
    """An actor with two layers, as `torch.onnx.export` of PyTorch 2 writes it: Gemm, Tanh and Constant."""
    one = numpy_helper.from_array(np.array(1.0, np.float32))
    minus = numpy_helper.from_array(np.array(-1.0, np.float32))
    rng = np.random.default_rng(1)
    tensors = {
        "w1": rng.normal(size=(16, 3)), "b1": rng.normal(size=16), "w2": rng.normal(size=(2, 16)),
        "b2": rng.normal(size=2),
    }  # fmt: skip
    nodes = [
        helper.make_node("Flatten", ["seen"], ["flat"]),
        helper.make_node("Gemm", ["flat", "w1", "b1"], ["h"], transB=1),
        helper.make_node("Tanh", ["h"], ["t"]),
        helper.make_node("Gemm", ["t", "w2", "b2"], ["raw"], transB=1),
        helper.make_node("Constant", [], ["low"], value=minus),
        helper.make_node("Constant", [], ["high"], value=one),
        helper.make_node("Clip", ["raw", "low", "high"], ["action"]),
    ]
    floats = {name: value.astype(np.float32) for name, value in tensors.items()}
    found = check(model(nodes, tensors=floats, batch="batch").SerializeToString())
    seen = np.array([[0.3, -0.2, 1.5]], np.float32)
    hidden = np.tanh(tensors["w1"] @ seen[0] + tensors["b1"])
    expected = np.clip(tensors["w2"] @ hidden + tensors["b2"], -1.0, 1.0)
    assert open_session(found.data).run(None, {"seen": seen})[0][0] == pytest.approx(expected, abs=1e-5)
