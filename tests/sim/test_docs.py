"""The examples, methods and worlds in docs/reference/simulation.md exist and work."""

import inspect
import math
import re
from operator import attrgetter
from pathlib import Path

from kbot.sim import Simulation
from kbot.world import BUILDERS, parameters
from kbot.world.sdf.model_paths import LIBRARY

TEXT = (Path(__file__).parents[2] / "docs" / "reference" / "simulation.md").read_text()


def test_examples_of_the_page_run():
    code = "".join(re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)[:2]).replace("robot.xacro", "kbot")
    names = {}
    exec(code, names)
    names["sim"].run(1.0)
    assert list(names["sim"].robots) == ["kbot"]


def test_the_program_of_the_page_reaches_its_goal(capsys):
    code = next(code for code in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL) if "def drive" in code)
    names = {}
    exec(code, names)
    sim = Simulation("kbot", "boxes")
    names["drive"](sim)
    pose = sim.ground_truth.pose
    assert math.hypot(pose.x - 1.0, pose.y - 0.5) < 0.1
    assert capsys.readouterr().out == "reached the goal\n"


def test_every_documented_method_exists(sim):
    table = TEXT.partition("## Change a running world")[2].partition("## ")[0]
    rows = [line.split("|")[3] for line in table.splitlines() if line.startswith("| ")][2:]
    assert len(rows) == 18
    for row in rows:
        for path, arguments in re.findall(r"`sim\.([\w.]+)(?:\(([\w, ]*)\))?`", row):
            found = attrgetter(path)(sim)
            if arguments:
                known = inspect.signature(found).parameters
                assert set(arguments.split(", ")) <= set(known)


def test_every_world_parameter_and_model_is_documented():
    for name in BUILDERS:
        row = re.search(rf"\| `{name}` \| (.*) \|", TEXT)[1]
        assert re.findall(r"\w+", re.sub(r"\(.*?\)", "", row)) == list(parameters(name))
    for model in LIBRARY.iterdir():
        assert f"`{model.name}`" in TEXT
