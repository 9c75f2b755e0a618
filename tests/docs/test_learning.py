"""What the pages on learning and policies claim: tables are those of the code, and blocks run."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper

from kbot.learn import PolicyInterface, save_policy

from .pages import DOCS, blocks, sections

sys.path.insert(0, str(DOCS))

from learning_tables import PAGE, with_tables

BLOCKS = blocks(PAGE.read_text("utf-8"), "python")


def test_the_tables_are_those_of_the_code() -> None:
    """If this fails: python docs/learning_tables.py."""
    page = PAGE.read_text("utf-8")
    assert with_tables(page) == page


@pytest.mark.parametrize("block", BLOCKS)
def test_blocks_run(block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "barn").mkdir()
    world = {"rows": ["#" * 30, "#" + "." * 28 + "#", "#" * 30], "path": [[-2.25, 3.0], [-2.25, 13.0]]}
    (tmp_path / "barn" / "worlds.json").write_text(json.dumps({"7": world}))
    monkeypatch.chdir(tmp_path)
    exec(compile("import gymnasium, kbot\n" + block, str(PAGE), "exec"), {})


@pytest.fixture
def follow_policy(tmp_path: Path) -> Path:
    """A policy that follows a path by pure pursuit at 0.3 m/s: w = 2 v y / L^2, with L = 0.4 m."""
    interface = PolicyInterface("path", linear=(0.0, 0.6), angular=(-4.0, 4.0))
    inputs = [field.name for field in interface.inputs]
    weights = np.zeros((len(inputs), 2), np.float32)
    weights[inputs.index("path_0.4_y"), 1] = 2.0 * 0.3 / 0.4**2 / 4.0
    graph = helper.make_graph(
        [helper.make_node("MatMul", ["seen", "weights"], ["action"])],
        "pursuit",
        [helper.make_tensor_value_info("seen", TensorProto.FLOAT, [1, len(inputs)])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, [1, 2])],
        [numpy_helper.from_array(weights, "weights")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    save_policy(model.SerializeToString(), interface, tmp_path / "follow.onnx")
    return tmp_path


def test_a_policy_follows_a_path_as_the_page_describes(
    follow_policy: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The environment is that of the training, whose speeds the policy has. The page is not opened."""
    monkeypatch.chdir(follow_policy)
    environment, controller = blocks(sections("reference/policies.md")["Follow a path"], "python")
    assert ', render_mode="human")' in environment
    trained = environment.replace(', render_mode="human")', ", max_speed=(0.6, 4.0))")
    exec(compile(trained, "environment", "exec"), {})
    assert capsys.readouterr().out == "arrived\n"
    names: dict[str, object] = {}
    exec(compile(controller, "controller", "exec"), names)
    pose = names["sim"].ground_truth.pose
    # 0.1 m before the end or at the next command 0.03 m later, it brakes from 0.3 m/s with 1 m/s^2: 0.045 m
    assert (pose.x, pose.y) == pytest.approx((1.0, 0.96), abs=0.03)
