"""What the documentation shows is true."""

import inspect
import re
from pathlib import Path

from kbot.sim import Simulation
from kbot.world import BUILDERS, parameters
from kbot.world.sdf.model_paths import LIBRARY

TEXT = (Path(__file__).parents[2] / "docs" / "simulation.md").read_text()


def test_the_example_runs():
    code = re.search(r"```python\n(.*?)```", TEXT, re.DOTALL)[1].replace("robot.xacro", "kbot")
    names = {}
    exec(code, names)
    names["sim"].run(1.0)
    assert list(names["sim"].robots) == ["kbot"]


def test_every_method_of_a_running_world_is_there():
    table = TEXT.partition("## What a running world allows")[2].partition("## ")[0]
    rows = [line.split("|")[3] for line in table.splitlines() if line.startswith("| ")][2:]
    assert len(rows) == 18
    for row in rows:
        for call in re.findall(r"`(\w+)(?:\(([\w, ]*)\))?`", row):
            name, parameters = call
            if name in ("name", "Simulation"):
                continue
            assert hasattr(Simulation, name) or name == "paused"
            if parameters:
                known = inspect.signature(getattr(Simulation, name)).parameters
                assert set(parameters.split(", ")) <= set(known)


def test_every_world_parameter_and_model_is_named():
    for name in BUILDERS:
        row = re.search(rf"\| `{name}` \| (.*) \|", TEXT)[1]
        assert re.findall(r"\w+", re.sub(r"\(.*?\)", "", row)) == list(parameters(name))
    for model in LIBRARY.iterdir():
        assert f"`{model.name}`" in TEXT
