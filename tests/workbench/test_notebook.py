"""What a notebook displays of a robot and a simulation, run by a real Jupyter and opened in a real
browser."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient
from nbconvert import HTMLExporter

import kbot
from kbot.checks import check_file

from .conftest import until
from .pages import Pages
from .pictures import blue, decode_png

CELLS = (
    "import kbot\nrobot = kbot.load('kbot')\nrobot.show({'left_wheel_joint': 0.5}, height=400)",
    """sim = kbot.Simulation(robot)
sim.cmd_vel(0.2, 0.0)
moments = []
for _ in range(20):
    sim.run(0.1)
    moments.append(sim.state())
sim.show(moments, height=400)""",
)


def test_the_page_is_stored_once() -> None:
    shown = kbot.load("kbot").show()
    assert "<iframe" in shown._repr_html_()
    assert len(repr(shown)) < 100  # notebooks store it beside the HTML, and a terminal prints it


@pytest.fixture(scope="module")
def notebook(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The HTML of a notebook that Jupyter has run."""
    cells = [nbformat.v4.new_code_cell(text) for text in CELLS]
    read = nbformat.v4.new_notebook(cells=cells)
    NotebookClient(read, timeout=300, startup_timeout=300, kernel_name="python3").execute()
    html, _ = HTMLExporter(template_name="basic").from_notebook_node(read)
    path = tmp_path_factory.mktemp("notebook") / "robot.html"
    path.write_text(html, encoding="utf-8")
    return path


@pytest.fixture
def page(notebook: Path, pages: Pages) -> Iterator[Any]:
    page = pages.open(notebook.as_uri(), viewport={"width": 900, "height": 1000})
    yield page
    complaints = list(page.complaints)
    pages.give_back(page)
    assert not complaints


def shown(page: Any, number: int) -> tuple[Any, Callable[[], np.ndarray]]:
    """Return what the cell of that number displays: its frame, and a function that returns its picture."""
    element = page.locator("iframe").nth(number)
    element.scroll_into_view_if_needed()
    frame = element.element_handle().content_frame()
    until(
        lambda: frame.evaluate(
            "!!window.kbot && kbot.frames > 1 && document.querySelector('canvas') !== null"
        )
    )
    return frame, lambda: decode_png(frame.locator(".picture").screenshot())


def test_a_robot_is_drawn_and_its_sliders_move_it(page: Any) -> None:
    frame, picture = shown(page, 0)
    until(lambda: blue(picture()).sum() > 2000)
    assert picture().shape[0] > 300
    slider = frame.locator("[data-joint=left_wheel_joint] [type=range]")
    assert float(slider.input_value()) == pytest.approx(0.5, abs=0.01)
    before = frame.evaluate("kbot.poses()")
    slider.press("ArrowRight")
    until(lambda: frame.evaluate("kbot.poses()") != before)


def test_a_simulation_is_drawn_with_a_slider_over_its_states(page: Any) -> None:
    frame, picture = shown(page, 1)
    until(lambda: blue(picture()).sum() > 1000)

    def x() -> float:
        return float(frame.evaluate("kbot.poses()[0]"))

    end = 0.4 - 0.02  # 2 s at 0.2 m/s, less the acceleration
    slider = frame.get_by_role("slider", name="Recorded state", exact=True)
    slider.press("End")
    until(lambda: abs(x() - end) < 0.02)
    slider.press("Home")
    until(lambda: abs(x()) < 0.02)
    until(lambda: blue(picture()).sum() > 1000)


def findings(path: Path, pages: Pages) -> list[str] | None:
    """Return the codes in the findings panel of a saved page, or None if it has no such panel."""
    page = pages.open(path.as_uri(), viewport={"width": 900, "height": 700})
    until(lambda: page.evaluate("!!window.kbot && kbot.frames > 1"))
    codes = page.locator("#findings .finding .code").all_inner_texts()
    has_panel = page.locator("#findings").count() == 1
    pages.give_back(page)
    return sorted(codes) if has_panel else None


@pytest.fixture
def faulty(tmp_path: Path) -> Path:
    """A robot that can be simulated, and that `kbot check` reports findings about."""
    file = tmp_path / "faulty.urdf"
    moment = '<inertia ixx="9" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'  # impossible: 9 > 1 + 1
    box = '<visual><geometry><box size="1 1 1"/></geometry></visual>'
    inertial = f'<inertial><mass value="1"/>{moment}</inertial>'
    file.write_text(f'<robot name="faulty"><link name="base">{inertial}{box}</link></robot>')
    return file


def test_the_findings_equal_those_of_the_check(faulty: Path, tmp_path: Path, pages: Pages) -> None:
    reported = sorted(finding.code for finding in check_file(str(faulty)))
    assert "I105" in reported
    robot = kbot.load(faulty)
    robot.show().save(tmp_path / "robot.html")
    assert findings(tmp_path / "robot.html", pages) == reported
    simulation = kbot.Simulation(robot)
    moments = [simulation.state()]
    simulation.step()
    simulation.show([*moments, simulation.state()]).save(tmp_path / "run.html")
    assert findings(tmp_path / "run.html", pages) == reported


def test_a_robot_without_a_file_has_no_findings_panel(faulty: Path, tmp_path: Path, pages: Pages) -> None:
    model = replace(kbot.load(faulty), loaded=None)
    kbot.Simulation(model).show().save(tmp_path / "run.html")
    assert findings(tmp_path / "run.html", pages) is None


def test_a_misspelt_joint_gets_a_suggestion() -> None:
    with pytest.raises(kbot.KbotError, match=r"no joint 'left_wheel_jont' .*did you mean 'left_wheel_joint'"):
        kbot.load("kbot").show({"left_wheel_jont": 1.0})
