"""Files written for rviz 1 and rviz 2, and cameras in both."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import pytest
import yaml

from kbot.workbench.displays.display_file import DisplayFile
from kbot.workbench.displays.display_settings import Display, DisplaySettings, plain
from kbot.workbench.displays.rviz import read_rviz, write_rviz
from kbot.workbench.protocol import DisplaysSaved, DisplaysText, SaveDisplays
from kbot.workbench.session.session import Session

from .conftest import until

OpenPage = Callable[..., Any]

CAMERA = """
Visualization Manager:
  Displays:
    - Class: {package}/Camera
      Enabled: true
      Image Rendering: background
      Name: Eye
      Overlay Alpha: 0.25
      Zoom Factor: 2
      Visibility:
        Grid: false
      {topic}
  Tools:
    - Class: {package}/Interact
"""
TOPICS = {"rviz": "Image Topic: /eye/image", "rviz_default_plugins": "Topic: {Value: /eye/image, Depth: 5}"}
LIDAR = DisplaySettings(
    {},
    (
        Display("LaserScan", "Lidar", True, {"topic": "/scan"}),
        Display("Twist", "Speed", True, {"topic": "/v"}),
    ),
)
MARKS = DisplaySettings(
    {},
    (
        Display("Marker", "One", True, {"topic": "/mark"}),
        Display("MarkerArray", "Many", True, {"topic": "/marks"}),
    ),
)


@pytest.mark.parametrize("package", TOPICS)
def test_a_camera_is_read_and_written(package: str) -> None:
    text = CAMERA.format(package=package, topic=TOPICS[package])
    found = read_rviz(text, "eye.rviz")
    camera = found.settings.displays[0]
    assert (camera.kind, camera.name) == ("Camera", "Eye")
    assert camera.properties == {
        "topic": "/eye/image",
        "rendering": "background",
        "alpha": 0.25,
        "zoom": 2.0,
        "Grid/show": False,
    }
    assert not any("Visibility" in note for note in found.notes)
    changed = DisplaySettings(
        {}, (Display("Camera", "Eye", True, {**camera.properties, "rendering": "overlay"}, 0),)
    )
    (entry,) = yaml.safe_load(write_rviz(changed, found.document))["Visualization Manager"]["Displays"]
    assert entry["Image Rendering"] == "overlay"
    assert entry["Visibility"] == {"Grid": False}
    if package == "rviz":
        assert entry["Image Topic"] == "/eye/image"
    else:
        assert entry["Topic"] == {"Value": "/eye/image", "Depth": 5}


def test_visibility_selects_the_displays_of_a_camera() -> None:
    """Also in a group, which can be hidden as a whole."""
    visibility = (
        "{Grid: true, Robot: {TF: false, RobotModel: true, Value: true}, Group: {Map: true, Value: false}}"
    )
    text = CAMERA.format(package="rviz", topic=TOPICS["rviz"]).replace(
        "Visibility:\n        Grid: false", f"Visibility: {visibility}"
    )
    found = read_rviz(text, "eye.rviz")
    (camera, _) = found.settings.displays
    assert {n: v for n, v in camera.properties.items() if "/" in n and n != "topic"} == {
        "TF/show": False,
        "Map/show": False,
    }
    shown = {**camera.properties, "TF/show": True, "Scan/show": False}
    changed = DisplaySettings({}, (Display("Camera", "Eye", True, shown, 0),))
    (entry,) = yaml.safe_load(write_rviz(changed, found.document))["Visualization Manager"]["Displays"]
    assert entry["Visibility"]["Robot"] == {"TF": True, "RobotModel": True, "Value": True}
    assert entry["Visibility"]["Scan"] is False


def copied(
    file: DisplayFile, kind: str, settings: DisplaySettings = LIDAR
) -> tuple[dict[str, Any], tuple[str, ...]]:
    answer = file.save(kind, plain(settings))
    assert isinstance(answer, DisplaysText)
    return yaml.safe_load(answer.text), answer.notes


def test_a_copy_is_for_the_requested_rviz_version() -> None:
    for kind, package, topic in (
        ("rviz1", "rviz", "/scan"),
        ("rviz2", "rviz_default_plugins", {"Value": "/scan"}),
    ):
        document, notes = copied(DisplayFile(), kind)
        manager = document["Visualization Manager"]
        assert manager["Displays"][0]["Class"] == f"{package}/LaserScan"
        assert manager["Displays"][0]["Topic"] == topic
        assert all(tool["Class"].startswith(f"{package}/") for tool in manager["Tools"])
        # the goal topic of each ROS's navigation
        goal = next(tool["Topic"] for tool in manager["Tools"] if tool["Class"].endswith("/SetGoal"))
        assert goal == ("/move_base_simple/goal" if kind == "rviz1" else {"Value": "/goal_pose"})
        assert any("Speed (Twist) is not saved: rviz 1" in note for note in notes) == (kind == "rviz1")


@pytest.mark.parametrize(("kind", "package"), [("rviz1", "rviz"), ("rviz2", "rviz_default_plugins")])
def test_markers_and_marker_arrays_have_their_own_displays(kind: str, package: str) -> None:
    document, notes = copied(DisplayFile(), kind, MARKS)
    displays = document["Visualization Manager"]["Displays"]
    assert [entry["Class"] for entry in displays] == [f"{package}/Marker", f"{package}/MarkerArray"]
    assert notes == ()
    topics = [entry.get("Topic", entry.get("Marker Topic")) for entry in displays]
    names = ["/mark", "/marks"]
    assert topics == (names if kind == "rviz1" else [{"Value": name} for name in names])
    read = read_rviz(yaml.safe_dump(document), "again.rviz").settings
    assert [(item.kind, item.properties["topic"]) for item in read.displays[:2]] == [
        ("Marker", "/mark"),
        ("MarkerArray", "/marks"),
    ]


@pytest.mark.parametrize("package", TOPICS)
def test_a_copy_for_the_same_rviz_keeps_unknown_parts(package: str) -> None:
    own, other = ("rviz1", "rviz2") if package == "rviz" else ("rviz2", "rviz1")
    file = DisplayFile()
    opened = file.open("eye.rviz", CAMERA.format(package=package, topic=TOPICS[package]))
    answer = file.save(own, opened.setup)
    assert isinstance(answer, DisplaysText)
    (entry,) = yaml.safe_load(answer.text)["Visualization Manager"]["Displays"]
    assert entry["Class"] == f"{package}/Camera"
    assert entry["Visibility"] == {"Grid": False}
    answer = file.save(other, opened.setup)
    assert isinstance(answer, DisplaysText)
    (entry,) = yaml.safe_load(answer.text)["Visualization Manager"]["Displays"]
    assert entry["Class"] == ("rviz_default_plugins/Camera" if package == "rviz" else "rviz/Camera")
    assert entry["Overlay Alpha"] == 0.25
    assert any("that only rviz" in note for note in answer.notes)


def test_an_empty_rviz_1_file_keeps_its_version(tmp_path: Path) -> None:
    """Without displays, its tools show the version."""
    path = tmp_path / "robot.rviz"
    path.write_text("Visualization Manager:\n  Displays: []\n  Tools:\n    - Class: rviz/MoveCamera\n")
    file = DisplayFile(str(path))
    assert isinstance(file.save("file", plain(LIDAR)), DisplaysSaved)
    (lidar,) = yaml.safe_load(path.read_text())["Visualization Manager"]["Displays"]
    assert (lidar["Class"], lidar["Topic"]) == ("rviz/LaserScan", "/scan")


@pytest.mark.parametrize(("choice", "prefix"), [("rviz1", "rviz"), ("rviz2", "rviz_default_plugins")])
def test_the_page_saves_a_copy_for_both_rviz_versions(
    viewing: str, open_page: OpenPage, choice: str, prefix: str
) -> None:
    page = open_page(viewing)
    with page.expect_download() as download:
        page.get_by_label("Display settings").select_option(choice)
    text = Path(download.value.path()).read_text(encoding="utf-8")
    options = yaml.safe_load(text)["Visualization Manager"]["Global Options"]
    # the root link, and the background of the light theme (#eef1f5)
    assert options == {"Fixed Frame": "base_footprint", "Background Color": "238; 241; 245"}
    classes = [entry["Class"] for entry in yaml.safe_load(text)["Visualization Manager"]["Displays"]]
    assert f"{prefix}/Grid" in classes
    until(lambda: "Saved as displays.rviz" in page.locator(".notices").inner_text())


@pytest.mark.parametrize("kind", ["rviz1", "rviz2"])
def test_a_copy_has_a_fixed_frame_that_exists_on_tf(
    driving: tuple[str, Session], kind: Literal["rviz1", "rviz2"]
) -> None:
    session = driving[1]
    for chosen, frame in (({}, "odom"), ({"frame": ""}, "odom"), ({"frame": "left_wheel"}, "left_wheel")):
        (answer,) = session.handle(SaveDisplays(kind, {"globals": chosen, "displays": []}), 1)
        assert isinstance(answer, DisplaysText)
        options = yaml.safe_load(answer.text)["Visualization Manager"]["Global Options"]
        assert options == {"Fixed Frame": frame}
    (answer,) = session.handle(SaveDisplays("kbot", {"globals": {}, "displays": []}), 1)
    assert isinstance(answer, DisplaysText)
    assert "odom" not in answer.text


POINTS = """
Visualization Manager:
  Displays:
    - Class: rviz_default_plugins/PointCloud2
      Autocompute Intensity Bounds: false
      Autocompute Value Bounds: {Max Value: 2.5, Min Value: -1, Value: false}
      Axis: Y
      Channel Name: ring
      Color Transformer: AxisColor
      Max Intensity: 4096
      Min Intensity: 7
      Name: Cloud
      Size (Pixels): 3
      Size (m): 0.05
      Style: Flat Squares
    - Class: rviz_default_plugins/MarkerArray
      Name: Marks
      Namespaces: {"": true, a/b: false}
"""


def test_only_changed_points_and_namespaces_are_written() -> None:
    found = read_rviz(POINTS, "points.rviz")
    cloud, marks = found.settings.displays[:2]
    assert found.notes == ()
    assert cloud.properties == {
        "style": "squares",
        "size": 3.0,
        "metres": 0.05,
        "by": "y",
        "channel": "ring",
        "auto": False,
        "low": -1.0,
        "high": 2.5,
    }
    assert marks.properties == {"a/b/show": False}
    before = yaml.safe_load(POINTS)["Visualization Manager"]["Displays"]
    kept = yaml.safe_load(write_rviz(found.settings, found.document))["Visualization Manager"]["Displays"]
    assert [{**entry, **old} for entry, old in zip(kept, before, strict=True)] == kept
    reported = {**cloud.properties, "by": "intensity", "style": "boxes", "high": 9.0}
    hidden = {**marks.properties, "/show": False}
    changed = DisplaySettings({}, (replace(cloud, properties=reported), replace(marks, properties=hidden)))
    item, two = yaml.safe_load(write_rviz(changed, found.document))["Visualization Manager"]["Displays"]
    assert (item["Color Transformer"], item["Style"], item["Max Intensity"]) == ("Intensity", "Boxes", 9.0)
    assert item["Autocompute Value Bounds"] == before[0]["Autocompute Value Bounds"]
    assert two["Namespaces"] == {"": False, "a/b": False}
    again = read_rviz(write_rviz(changed, found.document), "points.rviz").settings.displays
    assert [dict(display.properties) for display in again[:2]] == [reported, hidden]


def test_an_invalid_colour_range_is_reported_and_kept() -> None:
    found = read_rviz(POINTS.replace("Max Value: 2.5", "Max Value: top"), "points.rviz")
    assert found.notes == (
        'Cloud, line 6: Autocompute Value Bounds/Max Value is "top": expected a number;'
        " it is kept in the file",
    )
    assert "high" not in found.settings.displays[0].properties
    kept = yaml.safe_load(write_rviz(found.settings, found.document))["Visualization Manager"]["Displays"][0]
    assert kept["Autocompute Value Bounds"] == {"Max Value": "top", "Min Value": -1, "Value": False}


@pytest.mark.parametrize(("version", "name"), [(1, "rviz/WrenchStamped"), (2, "rviz_default_plugins/Wrench")])
def test_each_rviz_version_has_its_class_for_a_wrench(version: Literal[1, 2], name: str) -> None:
    force = DisplaySettings({}, (Display("Wrench", "Force", True, {"topic": "/f", "linear_scale": 0.5}),))
    text = write_rviz(force, None, version)
    (entry,) = yaml.safe_load(text)["Visualization Manager"]["Displays"]
    assert (entry["Class"], entry["Force Arrow Scale"]) == (name, 0.5)
    assert read_rviz(text, "f.rviz").settings.displays[0].kind == "Wrench"
