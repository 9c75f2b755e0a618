"""The world that `kbot sim` simulates in without `--world`."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from kbot.cli.main import run
from kbot.cli.sim.default_world import page_world
from kbot.model.load import load_robot

BOX = """<robot name="r"><link name="a"><visual><geometry><box size="{0} {1} 0.1"/></geometry></visual>
</link></robot>"""


@pytest.mark.parametrize(
    ("length", "width", "world"),
    [
        (0.2, 0.2, "playground"),
        (0.42, 0.56, "playground"),  # reaches hypot(0.21, 0.28) = 0.35 m
        (0.84, 1.12, "playground:scale=2"),
        (4.0, 1.8, "playground:scale=6.3"),  # hypot(2, 0.9) = 2.193 m, which is 6.27 times 0.35 m
    ],
)
def test_the_playground_fits_the_robot(tmp_path: Path, length: float, width: float, world: str) -> None:
    (tmp_path / "r.urdf").write_text(BOX.format(length, width))
    assert page_world(load_robot(str(tmp_path / "r.urdf")).require()) == world


@pytest.mark.parametrize(("words", "world"), [([], "playground"), (["--world", "empty"], "empty")])
def test_the_page_simulates_in_the_playground(
    monkeypatch: pytest.MonkeyPatch, words: list[str], world: str
) -> None:
    served: list[Any] = []
    monkeypatch.setattr("kbot.workbench.serve.serve_session", lambda session, _: served.append(session))
    assert run(["sim", "kbot", "--no-browser", "--port", "0", *words]) == 0
    assert served[0].about().world == world


def test_a_headless_run_has_an_empty_floor(capsys: pytest.CaptureFixture[str]) -> None:
    """In the playground a wall is in the way: at 0.45 rad it is 1.5 m ahead."""
    words = ["sim", "kbot", "--headless", "--pose", "0,0,0.45", "--cmd-vel", "0.5,0", "--duration", "5"]
    assert run([*words, "--json"]) == 0
    pose = json.loads(capsys.readouterr().out)["pose"]
    # 0.5 m/s for 5 s, less 0.125 m while it accelerates with 1 m/s^2
    assert math.hypot(pose["x"], pose["y"]) == pytest.approx(2.375, abs=0.03)
