"""The page as one file: without server and network, with the same kinematics as in Python."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kbot
from kbot.cli.main import run
from kbot.kinematics import FrameTree
from kbot.model.load import load_robot
from kbot.text import KbotError

from .conftest import until
from .pictures import id_image
from .projection import link_image, overlap
from .test_export import ARM

OpenPage = Callable[..., Any]


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    return path


def put(page: Any, joint: str, position: float) -> None:
    """Move a joint's slider as a user does."""
    page.evaluate(
        "([name, value]) => { const slider = document.querySelector(`[data-joint=${name}] [type=range]`);"
        " slider.value = value; slider.dispatchEvent(new Event('input')); }",
        [joint, position],
    )


def test_a_saved_page_moves_links_as_the_model_does(arm: Path, tmp_path: Path, open_page: OpenPage) -> None:
    out = tmp_path / "arm.html"
    assert run(["export", str(arm), "-o", str(out), "--joint", "shoulder:=0.3"]) == 0
    robot = load_robot(str(arm)).require()
    page = open_page(out.as_uri())
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    choice = np.random.default_rng(5)
    joints = {"shoulder": 0.3}
    for _ in range(5):
        poses = np.array(page.evaluate("kbot.poses()")).reshape(-1, 7)
        expected = FrameTree(robot).poses(joints)
        for row, name in zip(poses, robot.links, strict=True):
            assert row[:3] == pytest.approx(expected[name].translation, abs=1e-6)
            assert abs(row[3:] @ expected[name].quaternion_xyzw) == pytest.approx(1.0, abs=1e-9)
        page.evaluate("kbot.drawn()")
        clip = np.array(page.evaluate("kbot.camera()")["clipFromWorld"]).reshape(4, 4)
        ids, _ = id_image(page)
        drawn = link_image(robot, clip, ids.shape[1], ids.shape[0], joints=joints)
        assert overlap(ids >= 0, drawn >= 0) > 0.985
        joints = {"shoulder": float(choice.uniform(-1, 1)), "slide": float(choice.uniform(0, 0.1))}
        for name, position in joints.items():
            put(page, name, position)
    assert not [address for address in asked if not address.startswith(("file:", "data:", "blob:"))]


@pytest.mark.parametrize("size", [(390, 844), (560, 400), (320, 450)])
def test_a_narrow_saved_page_has_its_sliders_next_to_the_picture(
    size: tuple[int, int], arm: Path, tmp_path: Path, open_page: OpenPage
) -> None:
    """A phone, the output of a notebook's cell and a small phone whose browser takes some of its height."""
    out = tmp_path / "arm.html"
    assert run(["export", str(arm), "-o", str(out)]) == 0
    page = open_page(out.as_uri(), viewport={"width": size[0], "height": size[1]})
    slider = page.get_by_role("slider", name="shoulder", exact=True)
    until(slider.is_visible)
    before = page.evaluate("kbot.poses()")
    slider.press("End")
    until(lambda: page.evaluate("kbot.poses()") != before)
    picture, panel = (page.locator(entry).bounding_box() for entry in (".picture", "#joints"))
    assert min(picture["width"] / size[0], panel["width"] / size[0]) > 0.4
    assert picture["width"] * picture["height"] + panel["width"] * panel["height"] > 0.7 * size[0] * size[1]
    page.get_by_role("navigation", name="Panels").get_by_role("button", name="Links").click()
    until(page.locator("button[data-link=upper]").is_visible)
    assert not slider.is_visible()
    assert page.get_by_role("button", name="Drive", exact=True).count() == 0  # a saved page cannot drive


def test_a_saved_page_shows_the_line_of_a_link(arm: Path, tmp_path: Path, open_page: OpenPage) -> None:
    out = tmp_path / "arm.html"
    assert run(["export", str(arm), "-o", str(out)]) == 0
    page = open_page(out.as_uri())
    page.locator("button[data-link=upper]").click()
    until(lambda: '<link name="upper">' in page.locator("#source .cm-content").inner_text())


def test_a_saved_page_offers_no_edits(arm: Path, tmp_path: Path, open_page: OpenPage) -> None:
    out = tmp_path / "arm.html"
    arm.write_text(ARM.replace('<axis xyz="', '<axis rpy="0 0 0" xyz="', 1))
    assert run(["export", str(arm), "-o", str(out)]) == 0
    page = open_page(out.as_uri())
    until(lambda: page.locator("#findings li[data-code]").filter(has_text="rpy").count() == 1)
    assert page.locator(".fix").count() == 0
    page.locator("button[data-link=upper]").click()
    number = page.locator("#source .t-number").first
    until(lambda: number.count() == 1)
    assert number.evaluate("e => getComputedStyle(e).cursor") != "ew-resize"
    number.dblclick()
    assert page.locator("#source .edit").count() == 0


def test_nothing_in_a_description_ends_the_script_early(tmp_path: Path, open_page: OpenPage) -> None:
    file, out = tmp_path / "r.urdf", tmp_path / "r.html"
    file.write_text(ARM.replace("<robot", "<!-- </script><script>window.hurt = 1</script> -->\n<robot", 1))
    assert run(["export", str(file), "-o", str(out)]) == 0
    assert open_page(out.as_uri()).evaluate("window.hurt") is None


def test_a_notebook_shows_a_robot_in_a_frame(tmp_path: Path, open_page: OpenPage, browser: Any) -> None:
    html = kbot.load("kbot").show({"left_wheel_joint": 1.0}, height=300)._repr_html_()
    (tmp_path / "notebook.html").write_text(f"<!doctype html><body>{html}")
    page = browser.new_page()
    page.goto((tmp_path / "notebook.html").as_uri())
    frame = page.frames[1]
    until(lambda: frame.evaluate("!!window.kbot && kbot.frames > 0"))
    assert page.locator("iframe").bounding_box()["height"] == 300
    page.close()
    with pytest.raises(KbotError, match="no joint"):
        kbot.load("kbot").show({"elbow": 1.0})


@pytest.mark.parametrize(
    ("around", "system", "theme"),
    [("dark", "light", "dark"), ("normal", "dark", "light"), ("light dark", "dark", "dark")],
)
def test_a_frame_has_the_theme_of_its_notebook(
    around: str, system: Any, theme: str, tmp_path: Path, browser: Any
) -> None:
    html = kbot.load("kbot").show()._repr_html_()
    (tmp_path / "notebook.html").write_text(f'<!doctype html><body style="color-scheme: {around}">{html}')
    page = browser.new_page(color_scheme=system)
    page.goto((tmp_path / "notebook.html").as_uri())
    frame = page.frames[1]
    until(lambda: frame.evaluate("!!window.kbot && kbot.frames > 0"))
    assert frame.evaluate("document.documentElement.dataset.theme") == theme
    page.close()


def test_a_frame_follows_when_the_notebook_changes_its_theme(tmp_path: Path, browser: Any) -> None:
    """Through a class on its body, as in JupyterLab, or through another style sheet."""
    html = kbot.load("kbot").show()._repr_html_()
    (tmp_path / "notebook.html").write_text(
        "<!doctype html><style>body[data-jp-theme-light=false] { color-scheme: dark }</style>"
        f"<body data-jp-theme-light=true>{html}"
    )
    page = browser.new_page(color_scheme="light")
    page.goto((tmp_path / "notebook.html").as_uri())
    frame = page.frames[1]
    until(lambda: frame.evaluate("!!window.kbot && kbot.frames > 0"))
    theme = "document.documentElement.dataset.theme"
    assert frame.evaluate(theme) == "light"
    page.evaluate("document.body.dataset.jpThemeLight = 'false'")
    until(lambda: frame.evaluate(theme) == "dark")
    page.evaluate("document.body.dataset.jpThemeLight = 'true'")
    until(lambda: frame.evaluate(theme) == "light")
    page.evaluate(
        "document.head.append(Object.assign(document.createElement('link'),"
        " {rel: 'stylesheet', href: 'data:text/css,body{color-scheme:dark}'}))"
    )
    until(lambda: frame.evaluate(theme) == "dark")
    page.close()


def test_a_simulation_is_shown_at_all_states_and_not_changed(tmp_path: Path, open_page: OpenPage) -> None:
    sim = kbot.Simulation(kbot.load("kbot"), "boxes", seed=3)
    sim.cmd_vel(0.2, 0.4)
    moments, bases = [], []
    for _ in range(20):
        sim.run(0.1)
        moments.append(sim.state())
        bases.append(sim.link_pose("base_link").translation)
    before = sim.state_sha256()
    shown = sim.show(moments)
    assert sim.state_sha256() == before
    shown.save(tmp_path / "sim.html")
    page = open_page((tmp_path / "sim.html").as_uri())
    slider = page.get_by_role("slider", name="Recorded state")
    for index in (19, 4, 11):
        slider.evaluate("(e, value) => { e.value = value; e.dispatchEvent(new Event('input')); }", index)
        base = np.array(page.evaluate("kbot.poses()")).reshape(-1, 7)[1, :3]
        assert base == pytest.approx(bases[index], abs=1e-6)
    assert page.evaluate("kbot.time") == pytest.approx(1.2)


def test_a_state_of_another_simulation_is_refused() -> None:
    other = kbot.Simulation(kbot.load("kbot"), "boxes")
    with pytest.raises(KbotError, match="other robots or another world"):
        kbot.Simulation(kbot.load("kbot"), "empty").show([other.state()])


def test_the_current_state_of_a_simulation_needs_no_snapshots() -> None:
    page = kbot.Simulation(kbot.load("kbot")).show().page
    saved = re.search(r'id="saved">(.*?)</script>', page)
    assert saved is not None
    assert json.loads(saved[1])["states"] == []
