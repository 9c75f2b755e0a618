"""Files of rviz 1 and 2: what is read from them, and what is written back."""

from pathlib import Path

import numpy as np
import pytest
import yaml

import kbot
from kbot.templates import Sizes, make_package
from kbot.text import KbotError
from kbot.workbench.displays.display_settings import Display, DisplaySettings
from kbot.workbench.displays.marked_yaml import read_marked
from kbot.workbench.displays.rviz import read_rviz, write_rviz

from .rviz_texts import RVIZ1, RVIZ2


def test_rviz_1_is_read() -> None:
    found = read_rviz(RVIZ1, "robot.rviz")
    grid, lidar, eye, robot, world = found.settings.displays
    assert found.settings.globals == {"frame": "odom", "background": "#3031ff"}
    assert (grid.kind, grid.enabled) == ("Grid", True)
    assert grid.properties == {
        "cell": 0.25,
        "count": 10.0,
        "normal_count": 0.0,
        "plane": "XZ",
        "frame": "",
        "x": 1.0,
        "y": 0.0,
        "z": 0.0,
        "colour": "#a0a0a4",
        "alpha": 0.5,
    }
    assert (lidar.kind, lidar.name, lidar.enabled) == ("LaserScan", "Front lidar", False)
    assert lidar.properties == {
        "topic": "/base/scan",
        "size": 5.0,
        "decay": 2.0,
        "by": "x",
        "style": "squares",
    }
    assert (eye.kind, eye.properties["topic"]) == ("Image", "/camera/image")
    assert robot.properties["collision"] is True
    assert robot.properties["alpha"] == 0.75
    assert (robot.properties["left_wheel/show"], robot.properties["left_wheel/alpha"]) == (False, 0.25)
    assert world.kind == "World"


def test_skipped_parts_are_reported() -> None:
    notes = "\n".join(read_rviz(RVIZ1, "robot.rviz").notes)
    lines = [line.strip() for line in RVIZ1.splitlines()]
    imu = 1 + lines.index("- Class: rviz_plugin_tutorials/Imu")
    lidar = 1 + lines.index("- Class: rviz/LaserScan")
    assert f"Imu (rviz_plugin_tutorials/Imu), line {imu}: KBot does not support this display" in notes
    assert f"Front lidar (LaserScan), line {lidar}: not used: Queue Size" in notes
    assert "Robot Description" not in notes
    assert "Panels" not in notes
    other = RVIZ1.replace("Robot Description: robot_description", "Robot Description: /r2/robot_description")
    other = other.replace("- Class: rviz/Displays", "- Class: moveit_rviz_plugin/Panel")
    notes = "\n".join(read_rviz(other, "robot.rviz").notes)
    assert "not used: Robot Description" in notes
    assert "moveit_rviz_plugin/Panel in Panels: KBot does not support it; it is kept in the file" in notes


def test_rviz_files_of_kbot_are_read_completely(tmp_path: Path) -> None:
    made = make_package(tmp_path / "my_robot", "my_robot", Sizes())
    ours = Path(kbot.__file__).parent / "robots" / "kbot_description" / "config" / "kbot.rviz"
    files = [ours, *(tmp_path / "my_robot" / path for path in made.added if path.suffix == ".rviz")]
    assert len(files) == 3
    for file in files:
        assert read_rviz(file.read_text(), file.name).notes == ()


def test_rviz_2_is_read_with_its_view_from_above() -> None:
    settings = read_rviz(RVIZ2, "nav.rviz").settings
    grid, odometry, _ = settings.displays
    assert grid.properties == {"topic": "/map", "scheme": "costmap", "alpha": 0.7}
    assert odometry.properties["shape"] == "arrow"
    assert odometry.properties["covariance"] is True
    assert odometry.properties["covariance_alpha"] == 0.4
    assert odometry.properties["colour"] == "#ff1900"
    view = settings.view
    assert view is not None
    assert view.flat
    assert view.target == (1.0, 2.0, 0.0)
    assert np.allclose(view.eye[:2], (1.0, 2.0), atol=0.02)
    assert view.eye[1] < 2.0  # so that y points up in the picture


@pytest.mark.parametrize("text", [RVIZ1, RVIZ2])
def test_unknown_parts_of_an_rviz_file_are_written_back(text: str) -> None:
    found = read_rviz(text, "a.rviz")
    again = yaml.safe_load(write_rviz(found.settings, found.document))
    before = yaml.safe_load(text)
    view = before["Visualization Manager"].pop("Views")["Current"]
    now = again["Visualization Manager"].pop("Views")["Current"]
    for display in before["Visualization Manager"]["Displays"]:
        display["Value"] = True  # rviz writes it beside Enabled
    for display in again["Visualization Manager"]["Displays"]:
        display["Value"] = True
    assert _tidy(again) == _tidy(before)
    for name, value in view.items():
        same = (
            now[name] == value
            if isinstance(value, str)
            else np.allclose(_flat(now[name]), _flat(value), atol=2e-3)
        )
        assert same, name


def _tidy(value: object) -> object:
    """Remove the redundant enabled fields of groups and unknown displays."""
    if isinstance(value, dict):
        return {k: _tidy(v) for k, v in value.items() if k != "Value" or not isinstance(v, bool)}
    return [_tidy(item) for item in value] if isinstance(value, list) else value


def _flat(value: object) -> list[float]:
    return list(value.values()) if isinstance(value, dict) else [value]


def test_changes_are_written_where_rviz_reads_them() -> None:
    found = read_rviz(RVIZ1, "a.rviz")
    _, lidar, _, robot, world = found.settings.displays
    changed = DisplaySettings(
        {"frame": "map"},
        (
            Display(
                "LaserScan",
                "Renamed",
                True,
                {**lidar.properties, "topic": "/scan", "by": "intensity"},
                lidar.source,
            ),
            robot,
            world,
            Display("Path", "Plan", True, {"topic": "/plan", "colour": "#ff0000"}),
            Display("Trail", "Trail"),
        ),
    )
    manager = yaml.safe_load(write_rviz(changed, found.document))["Visualization Manager"]
    names = [display["Name"] for display in manager["Displays"]]
    assert names == ["Sensors", "RobotModel", "Plan"]  # the grid and the image were removed
    sensors = manager["Displays"][0]["Displays"]
    assert [display["Name"] for display in sensors] == ["Renamed", "Imu"]
    assert (sensors[0]["Topic"], sensors[0]["Color Transformer"]) == ("/scan", "Intensity")
    plan = manager["Displays"][-1]
    assert (plan["Class"], plan["Topic"], plan["Color"]) == ("rviz/Path", "/plan", "255; 0; 0")
    assert manager["Global Options"]["Fixed Frame"] == "map"
    assert manager["Tools"] == [{"Class": "rviz/Interact"}]


def test_a_new_rviz_file_is_for_rviz_2() -> None:
    text = write_rviz(DisplaySettings({}, (Display("LaserScan", "Lidar", True, {"topic": "/scan"}),)))
    (lidar,) = yaml.safe_load(text)["Visualization Manager"]["Displays"]
    assert lidar["Class"] == "rviz_default_plugins/LaserScan"
    assert lidar["Topic"] == {"Value": "/scan"}
    assert lidar["Style"] == "Points"
    (again, _) = read_rviz(text, "new.rviz").settings.displays
    assert again.properties["topic"] == "/scan"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Panels: []\n", "a.rviz:1: not an rviz configuration"),
        ("Visualization Manager:\n  Displays: 3\n", "a.rviz:2: expected a list"),
        ("Visualization Manager:\n  Displays:\n    - Name: x\n", "a.rviz:3: an rviz display needs a 'Class'"),
        ("Visualization Manager: {\n", "a.rviz:2: not YAML"),
    ],
)
def test_malformed_rviz_files_are_reported_with_the_line(text: str, expected: str) -> None:
    with pytest.raises(KbotError) as caught:
        read_rviz(text, "a.rviz")
    assert expected in str(caught.value)


def test_merged_fields_are_read() -> None:
    text = "a: &a {b: 1, c: [2]}\nd: {<<: *a, c: 3}\n"
    fields = read_marked(text, "a.rviz").fields["d"]
    assert fields.plain == {"b": 1, "c": 3}
    assert (fields.fields["b"].line, fields.fields["c"].line) == (1, 2)


def test_too_many_values_are_refused() -> None:
    text = "[" + "1, " * 49_998 + "1]"
    assert len(read_marked(text, "a.rviz").items) == 49_999
    with pytest.raises(KbotError, match=r"a\.rviz:1: not YAML: it contains more than 50,000 values"):
        read_marked(text.replace("1]", "1, 1]"), "a.rviz")
    with pytest.raises(KbotError, match=r"a\.rviz:1: not YAML: its aliases expand to too many values"):
        read_marked("a: &a [" + "1, " * 300 + "1]\nb: [" + "*a, " * 300 + "*a]", "a.rviz")


def test_invalid_values_are_reported_and_kept() -> None:
    text = RVIZ2.replace("Alpha: 0.7", "Alpha: much").replace("costmap", "plaid")
    found = read_rviz(text, "a.rviz")
    notes = "\n".join(found.notes)
    assert 'Map, line 4: Alpha is "much": expected a number; it is kept in the file' in notes
    assert "Map, line 5: Color Scheme" in notes
    kept = yaml.safe_load(write_rviz(found.settings, found.document))["Visualization Manager"]["Displays"][0]
    assert (kept["Alpha"], kept["Color Scheme"]) == ("much", "plaid")


def test_invalid_values_of_links_are_reported_and_kept() -> None:
    text = """Visualization Manager:
  Displays:
    - Class: rviz_default_plugins/RobotModel
      Name: Robot
      Links: {base: {Alpha: [], Value: true}, arm: {Alpha: 0.5}}
"""
    found = read_rviz(text, "a.rviz")
    assert found.notes == ("base, line 5: Alpha is a list: expected a number; it is kept in the file",)
    assert found.settings.displays[0].properties == {"arm/alpha": 0.5}
    kept = yaml.safe_load(write_rviz(found.settings, found.document))["Visualization Manager"]["Displays"][0]
    assert kept["Links"]["base"]["Alpha"] == []
