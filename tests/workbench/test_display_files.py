"""Settings of displays in files: KBot's own and those of rviz."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

import kbot
from kbot.templates import Sizes, make_package
from kbot.text import KbotError
from kbot.workbench.displays.files import DisplayFile
from kbot.workbench.displays.kinds import KINDS
from kbot.workbench.displays.rviz import read_rviz, write_rviz
from kbot.workbench.displays.settings import Display, Settings, View, read_settings, write_settings
from kbot.workbench.protocol import DisplaysSaved, DisplaysText

# as rviz 1 writes it; and as rviz 2 does, with another view
RVIZ1 = """\
Panels:
  - Class: rviz/Displays
    Name: Displays
Visualization Manager:
  Class: ""
  Displays:
    - Alpha: 0.5
      Cell Size: 0.25
      Class: rviz/Grid
      Color: 160; 160; 164
      Enabled: true
      Line Style:
        Line Width: 0.03
        Value: Lines
      Name: Grid
      Normal Cell Count: 0
      Offset:
        X: 1
        Y: 0
        Z: 0
      Plane: XZ
      Plane Cell Count: 10
      Reference Frame: <Fixed Frame>
      Value: true
    - Class: rviz/Group
      Enabled: true
      Name: Sensors
      Displays:
        - Class: rviz/LaserScan
          Axis: X
          Color Transformer: AxisColor
          Decay Time: 2
          Enabled: false
          Name: Front lidar
          Size (Pixels): 5
          Queue Size: 10
          Style: Flat Squares
          Topic: /base/scan
          Value: false
        - Class: rviz_plugin_tutorials/Imu
          Enabled: true
          Name: Imu
    - Class: rviz/Image
      Enabled: true
      Image Topic: /camera/image
      Name: Eye
    - Class: rviz/RobotModel
      Alpha: 0.75
      Collision Enabled: true
      Enabled: true
      Links:
        All Links Enabled: true
        left_wheel:
          Alpha: 0.25
          Show Axes: false
          Value: false
      Name: RobotModel
      Robot Description: robot_description
  Enabled: true
  Global Options:
    Background Color: 48; 49; 255
    Fixed Frame: odom
    Frame Rate: 30
  Name: root
  Tools:
    - Class: rviz/Interact
  Views:
    Current:
      Class: rviz/Orbit
      Distance: 2
      Focal Point:
        X: 1
        Y: 0
        Z: 0
      Pitch: 0.5
      Yaw: 1.5707963
    Saved: ~
Window Geometry:
  Height: 846
"""
RVIZ2 = """\
Visualization Manager:
  Displays:
    - Class: rviz_default_plugins/Map
      Alpha: 0.7
      Color Scheme: costmap
      Enabled: true
      Name: Map
      Topic:
        Depth: 5
        Durability Policy: Transient Local
        Value: /map
      Update Topic:
        Value: /map_updates
      Use Timestamp: false
    - Class: rviz_default_plugins/Odometry
      Enabled: true
      Name: Odometry
      Keep: 50
      Covariance:
        Value: true
        Position:
          Alpha: 0.4
          Color: 204; 51; 204
      Shape:
        Color: 255; 25; 0
        Shaft Length: 0.3
        Value: Arrow
      Topic:
        Value: /odom
  Global Options:
    Fixed Frame: map
  Views:
    Current:
      Class: rviz_default_plugins/TopDownOrtho
      Angle: 0
      Scale: 100
      X: 1
      Y: 2
"""


def test_every_kind_has_properties_that_are_told_apart() -> None:
    assert len({kind.name for kind in KINDS}) == len(KINDS)
    for kind in KINDS:
        names = [property.name for property in kind.properties]
        assert len(set(names)) == len(names), kind.name


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


def test_what_is_not_shown_is_named() -> None:
    notes = "\n".join(read_rviz(RVIZ1, "robot.rviz").notes)
    lines = [line.strip() for line in RVIZ1.splitlines()]
    imu = 1 + lines.index("- Class: rviz_plugin_tutorials/Imu")
    lidar = 1 + lines.index("- Class: rviz/LaserScan")
    assert f"Imu (rviz_plugin_tutorials/Imu), line {imu}: no such display here" in notes
    assert f"Front lidar (LaserScan), line {lidar}: not used: Queue Size" in notes
    assert "Robot Description" not in notes
    assert "Panels" not in notes
    other = RVIZ1.replace("Robot Description: robot_description", "Robot Description: /r2/robot_description")
    other = other.replace("- Class: rviz/Displays", "- Class: moveit_rviz_plugin/Panel")
    notes = "\n".join(read_rviz(other, "robot.rviz").notes)
    assert "not used: Robot Description" in notes
    assert "moveit_rviz_plugin/Panel of Panels: kept in the file" in notes


def test_our_own_files_of_rviz_are_used_whole(tmp_path: Path) -> None:
    made = make_package(tmp_path / "my_robot", "my_robot", Sizes())
    ours = Path(kbot.__file__).parent / "robots" / "kbot_description" / "config" / "kbot.rviz"
    files = [ours, *(tmp_path / "my_robot" / path for path in made if path.suffix == ".rviz")]
    assert len(files) == 3
    for file in files:
        assert read_rviz(file.read_text(), file.name).notes == ()


def test_the_orbit_of_rviz_is_an_eye_and_a_target() -> None:
    view = read_rviz(RVIZ1, "robot.rviz").settings.view
    assert view is not None
    # 2 m away from (1, 0, 0), turned to y, 0.5 rad above
    assert np.allclose(view.eye, (1.0, 2.0 * math.cos(0.5), 2.0 * math.sin(0.5)), atol=1e-6)
    assert view.target == (1.0, 0.0, 0.0)
    assert not view.flat


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
    assert view.eye[1] < 2.0  # so that y is up in the picture


@pytest.mark.parametrize(
    ("kind", "eye"),
    [
        ("FPS", (1.0, 2.0, 0.5)),
        ("ThirdPersonFollower", (3.0, 0.0, 0.0)),
        ("XYOrbit", (3.0, 0.0, 0.0)),
    ],
)
def test_the_other_views_of_rviz(kind: str, eye: tuple[float, float, float]) -> None:
    text = f"""\
Visualization Manager:
  Views:
    Current:
      Class: rviz/{kind}
      Distance: 3
      Focal Point: {{X: 0, Y: 0, Z: 0}}
      Position: {{X: 1, Y: 2, Z: 0.5}}
      Pitch: 0
      Yaw: 0
"""
    view = read_rviz(text, "a.rviz").settings.view
    assert view is not None
    assert np.allclose(view.eye, eye)
    assert view.follow == (kind == "ThirdPersonFollower")
    if kind == "FPS":
        assert np.allclose(view.target, (2.0, 2.0, 0.5))  # it looks ahead, along x
    again = yaml.safe_load(write_rviz(Settings({}, (), view), read_rviz(text, "a.rviz").document))
    assert read_rviz(yaml.safe_dump(again), "b.rviz").settings.view == View(
        tuple(round(v, 6) for v in view.eye),
        view.target,
        view.flat,
        view.follow,
    )


def test_a_view_is_told_from_its_target_frame() -> None:
    """As rviz has it: the focal point is in that frame, and goes along with it."""
    text = """\
Visualization Manager:
  Views:
    Current:
      Class: rviz_default_plugins/Orbit
      Distance: 2
      Focal Point: {X: 0.5, Y: 0, Z: 0}
      Pitch: 0
      Yaw: 0
      Target Frame: base_link
"""
    found = read_rviz(text, "a.rviz")
    assert found.settings.view == View((2.5, 0.0, 0.0), (0.5, 0.0, 0.0), follow=True, frame="base_link")
    kept = write_settings(found.settings)
    assert read_settings(kept, "a.kbot.yaml").view == found.settings.view

    def written(view: View) -> str:
        current = yaml.safe_load(write_rviz(Settings({}, (), view), found.document))
        return str(current["Visualization Manager"]["Views"]["Current"]["Target Frame"])

    eye, at = (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    assert written(View(eye, at, follow=True, frame="gripper")) == "gripper"
    assert written(View(eye, at, follow=False)) == "<Fixed Frame>"


@pytest.mark.parametrize("text", [RVIZ1, RVIZ2])
def test_what_is_read_is_written_back_with_all_that_rviz_had(text: str) -> None:
    found = read_rviz(text, "a.rviz")
    again = yaml.safe_load(write_rviz(found.settings, found.document))
    before = yaml.safe_load(text)
    view = before["Visualization Manager"].pop("Views")["Current"]
    now = again["Visualization Manager"].pop("Views")["Current"]
    for display in before["Visualization Manager"]["Displays"]:
        display["Value"] = True  # which rviz writes beside Enabled
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
    """Without what displays in groups and unknown ones say of being shown twice."""
    if isinstance(value, dict):
        return {k: _tidy(v) for k, v in value.items() if k != "Value" or not isinstance(v, bool)}
    return [_tidy(item) for item in value] if isinstance(value, list) else value


def _flat(value: object) -> list[float]:
    return list(value.values()) if isinstance(value, dict) else [value]


def test_changes_are_written_where_rviz_reads_them() -> None:
    found = read_rviz(RVIZ1, "a.rviz")
    _, lidar, _, robot, world = found.settings.displays
    changed = Settings(
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


def test_a_new_file_for_rviz_is_one_of_rviz_2() -> None:
    text = write_rviz(Settings({}, (Display("LaserScan", "Lidar", True, {"topic": "/scan"}),)))
    (lidar,) = yaml.safe_load(text)["Visualization Manager"]["Displays"]
    assert lidar["Class"] == "rviz_default_plugins/LaserScan"
    assert lidar["Topic"] == {"Value": "/scan"}
    assert lidar["Style"] == "Points"
    (again, _) = read_rviz(text, "new.rviz").settings.displays
    assert again.properties["topic"] == "/scan"


def test_own_files_say_all_that_is_set() -> None:
    settings = Settings(
        {"frame": "map", "light": 0.5},
        (
            Display("Grid", "Boden", False, {"cell": 0.5}),
            Display("RobotModel", "KBot", True, {"base_link/show": False, "base_link/alpha": 0.5}),
        ),
        View((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), True, False),
    )
    assert read_settings(write_settings(settings), "a.kbot.yaml") == settings


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("displays: [", "a.kbot.yaml:1: no YAML"),
        ("displays:\n- kind: Gird\n", "a.kbot.yaml:2: no display of kind \"Gird\": did you mean 'Grid'?"),
        ("displays:\n- name: Grid\n", "a.kbot.yaml:2: a display has a 'kind'"),
        (
            "displays:\n- kind: Grid\n  properties:\n    cel: 1\n",
            "a.kbot.yaml:4: 'cel' is no property of Grid: did you mean 'cell'?",
        ),
        (
            "displays:\n- kind: Grid\n  properties: {cell: -1}\n",
            "a.kbot.yaml:3: 'cell' is -1, where 0 to 100 is meant",
        ),
        ("displays:\n- kind: Grid\n  properties: {cell: .nan}\n", "a number is meant"),
        ("displays:\n- kind: Grid\n  properties: {colour: red}\n", "a colour is meant"),
        ("displays:\n- kind: Grid\n  enabled: perhaps\n", "a.kbot.yaml:3: 'enabled' is \"perhaps\""),
        ("displays: 3\n", "a.kbot.yaml:1: a list is expected here, not 3"),
        ("display: []\n", "a.kbot.yaml:1: 'display' is not known here: did you mean 'displays'?"),
        ("view: {eye: [1, 2], target: [0, 0, 0]}\n", "three numbers each"),
        ("- 1\n", "fields by name are expected here, not a list"),
        ("a: &a [*a]\n", "a.kbot.yaml:1: "),
        ("displays:\n- kind: Grid\n  enabled: !!int ''\n", 'a.kbot.yaml:3: "" is no int'),
        ("displays:\n- kind: !!bool perhaps\n", 'a.kbot.yaml:2: "perhaps" is no bool'),
        (f"displays: 0x{'f' * 5000}\n", "a.kbot.yaml:1: no setting is a number as large as this"),
    ],
)
def test_malformed_files_say_what_is_wrong_and_where(text: str, said: str) -> None:
    with pytest.raises(KbotError) as caught:
        read_settings(text, "a.kbot.yaml")
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("Panels: []\n", "a.rviz:1: no configuration of rviz"),
        ("Visualization Manager:\n  Displays: 3\n", "a.rviz:2: a list is expected here"),
        ("Visualization Manager:\n  Displays:\n    - Name: x\n", "a.rviz:3: a display of rviz has a 'Class'"),
        ("Visualization Manager: {\n", "a.rviz:2: no YAML"),
    ],
)
def test_malformed_rviz_files_say_what_is_wrong_and_where(text: str, said: str) -> None:
    with pytest.raises(KbotError) as caught:
        read_rviz(text, "a.rviz")
    assert said in str(caught.value)


def test_values_of_no_use_are_named_and_kept() -> None:
    text = RVIZ2.replace("Alpha: 0.7", "Alpha: much").replace("costmap", "plaid")
    found = read_rviz(text, "a.rviz")
    notes = "\n".join(found.notes)
    assert 'Map, line 4: Alpha is "much", where a number is meant; it is kept' in notes
    assert "Map, line 5: Color Scheme" in notes
    kept = yaml.safe_load(write_rviz(found.settings, found.document))["Visualization Manager"]["Displays"][0]
    assert (kept["Alpha"], kept["Color Scheme"]) == ("much", "plaid")


def test_a_page_saves_to_the_file_it_came_from(tmp_path: Path) -> None:
    path = tmp_path / "robot.rviz"
    path.write_text(RVIZ1)
    file = DisplayFile(str(path))
    assert file.greeting is not None
    setup = dict(file.greeting.setup)
    setup["displays"][0]["properties"]["cell"] = 0.125
    assert isinstance(file.save("file", setup), DisplaysSaved)
    grid = yaml.safe_load(path.read_text())["Visualization Manager"]["Displays"][0]
    assert grid["Cell Size"] == 0.125
    assert grid["Line Style"] == {"Line Width": 0.03, "Value": "Lines"}
    copy = file.save("kbot", setup)
    assert isinstance(copy, DisplaysText)
    assert read_settings(copy.text, copy.name).displays[0].properties["cell"] == 0.125
    before = path.read_text()
    with pytest.raises(KbotError, match="no display of kind"):
        file.save("file", {"displays": [{"kind": "Nothing"}]})
    assert path.read_text() == before


def test_a_file_that_is_not_there_is_made_when_it_is_saved(tmp_path: Path) -> None:
    path = tmp_path / "new.kbot.yaml"
    file = DisplayFile(str(path))
    assert not path.exists()
    file.save(
        "file", {"globals": {}, "displays": [{"kind": "TF", "name": "TF", "enabled": True, "properties": {}}]}
    )
    assert read_settings(path.read_text(), "a").displays[0].kind == "TF"
    with pytest.raises(KbotError, match="start with --config"):
        DisplayFile().save("file", {})
    with pytest.raises(KbotError, match="settings of displays are in"):
        DisplayFile("robot.urdf")


def test_a_frame_held_still_goes_before_the_files_own(tmp_path: Path) -> None:
    path = tmp_path / "seen.rviz"
    path.write_text(RVIZ1)
    for file, others in ((DisplayFile(str(path)), True), (DisplayFile(), False)):
        file.hold("base_link")
        assert file.greeting is not None
        assert file.greeting.setup["globals"]["frame"] == "base_link"
        assert ("displays" in file.greeting.setup) == others
