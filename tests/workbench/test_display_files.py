"""Display settings in files: KBot's own format and rviz's."""

from pathlib import Path

import pytest
import yaml

from kbot.text import KbotError
from kbot.workbench.displays.display_file import DisplayFile
from kbot.workbench.displays.display_settings import (
    Display,
    DisplaySettings,
    View,
    read_settings,
    write_settings,
)
from kbot.workbench.displays.kinds import KINDS
from kbot.workbench.protocol import DisplaysSaved, DisplaysText

from .rviz_texts import RVIZ1


def test_properties_of_a_kind_have_distinct_names() -> None:
    assert len({kind.name for kind in KINDS}) == len(KINDS)
    for kind in KINDS:
        names = [property.name for property in kind.properties]
        assert len(set(names)) == len(names), kind.name


def test_own_files_store_every_setting() -> None:
    settings = DisplaySettings(
        {"frame": "map", "light": 0.5},
        (
            Display("Grid", "Boden", False, {"cell": 0.5}),
            Display("RobotModel", "KBot", True, {"base_link/show": False, "base_link/alpha": 0.5}),
        ),
        View((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), True, False),
    )
    assert read_settings(write_settings(settings), "a.kbot.yaml") == settings


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("displays: [", "a.kbot.yaml:1: not YAML"),
        ("displays:\n- kind: Gird\n", "a.kbot.yaml:2: unknown display kind \"Gird\": did you mean 'Grid'?"),
        ("displays:\n- name: Grid\n", "a.kbot.yaml:2: a display needs a 'kind'"),
        (
            "displays:\n- kind: Grid\n  properties:\n    cel: 1\n",
            "a.kbot.yaml:4: 'cel' is not a property of Grid: did you mean 'cell'?",
        ),
        (
            "displays:\n- kind: Grid\n  properties: {cell: -1}\n",
            "a.kbot.yaml:3: 'cell' is -1: expected 0 to 100",
        ),
        ("displays:\n- kind: Grid\n  properties: {cell: .nan}\n", "expected a number"),
        ("displays:\n- kind: Grid\n  properties: {colour: red}\n", "expected a colour"),
        ("displays:\n- kind: Grid\n  enabled: perhaps\n", "a.kbot.yaml:3: 'enabled' is \"perhaps\""),
        ("displays: 3\n", "a.kbot.yaml:1: expected a list, not 3"),
        ("display: []\n", "a.kbot.yaml:1: unknown field 'display': did you mean 'displays'?"),
        ("view: {eye: [1, 2], target: [0, 0, 0]}\n", "a list of three numbers"),
        ("- 1\n", "expected a mapping, not a list"),
        ("a: &a [*a]\n", "a.kbot.yaml:1: "),
        ("displays:\n- kind: Grid\n  enabled: !!int ''\n", 'a.kbot.yaml:3: not YAML: "" is not a valid int'),
        ("displays:\n- kind: !!bool perhaps\n", 'a.kbot.yaml:2: not YAML: "perhaps" is not a valid bool'),
        (f"displays: 0x{'f' * 5000}\n", "a.kbot.yaml:1: not YAML: a number is too large"),
    ],
)
def test_malformed_files_are_reported_with_the_line(text: str, expected: str) -> None:
    with pytest.raises(KbotError) as caught:
        read_settings(text, "a.kbot.yaml")
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_page_saves_to_its_file(tmp_path: Path) -> None:
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
    with pytest.raises(KbotError, match="unknown display kind"):
        file.save("file", {"displays": [{"kind": "Nothing"}]})
    assert path.read_text() == before


def test_a_missing_file_is_created_on_save(tmp_path: Path) -> None:
    path = tmp_path / "new.kbot.yaml"
    file = DisplayFile(str(path))
    assert not path.exists()
    file.save(
        "file", {"globals": {}, "displays": [{"kind": "TF", "name": "TF", "enabled": True, "properties": {}}]}
    )
    assert read_settings(path.read_text(), "a").displays[0].kind == "TF"
    with pytest.raises(KbotError, match="start kbot view or kbot sim --config FILE"):
        DisplayFile().save("file", {})
    with pytest.raises(KbotError, match="display settings must be in"):
        DisplayFile("robot.urdf")


def test_a_given_fixed_frame_replaces_the_files_own(tmp_path: Path) -> None:
    path = tmp_path / "seen.rviz"
    path.write_text(RVIZ1)
    for file, others in ((DisplayFile(str(path)), True), (DisplayFile(), False)):
        file.set_fixed_frame("base_link")
        assert file.greeting is not None
        assert file.greeting.setup["globals"]["frame"] == "base_link"
        assert ("displays" in file.greeting.setup) == others
