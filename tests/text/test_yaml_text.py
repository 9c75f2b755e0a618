"""Every reader of YAML refuses deep nesting, at which PyYAML's loaders in C overflow the stack."""

from pathlib import Path

import pytest
import yaml

from kbot.checks.facts.drivers import compose
from kbot.cli.graph.asking import read_yaml as read_word
from kbot.launch.placed_yaml import BadYaml, load_placed_yaml
from kbot.launch.reporter import Reporter
from kbot.launch.ros2.markup import read_yaml as read_launch
from kbot.launch.values import load_yaml as load_parameters
from kbot.text import DescriptionError, KbotError, Source
from kbot.text.yaml_text import MOST_LEVELS, check_nesting, load_yaml
from kbot.workbench.displays.marked_yaml import read_yaml as read_rviz
from kbot.world.occupancy_files import read_map
from kbot.xacro import Packages, expand_text

READERS = {
    "load_yaml": load_yaml,
    "a controller's parameters": load_parameters,
    "a node's parameters": lambda text: load_placed_yaml(Source("p.yaml", text)),
    "a launch file": lambda text: read_launch(Source("l.yaml", text), Reporter(Packages())),
    "a view of RViz": lambda text: read_rviz(text, "v.rviz"),
    "a word of a command line": lambda text: read_word(text, "--value", "1"),
}


@pytest.mark.parametrize("text", ["[" * 100_000, "{a: " * 100_000, "a: &x " + "[" * 100_000])
class TestDeepNesting:
    @pytest.mark.parametrize("reader", READERS)
    def test_it_is_refused(self, reader: str, text: str) -> None:
        with pytest.raises((yaml.YAMLError, ValueError, BadYaml, KbotError), match=r"nested|recursion"):
            READERS[reader](text)

    def test_a_map_is_refused(self, text: str, tmp_path: Path) -> None:
        (tmp_path / "map.yaml").write_text(text)
        with pytest.raises(KbotError, match="nested more than 100 levels deep"):
            read_map(tmp_path / "map.yaml")

    def test_xacro_refuses_it(self, text: str, tmp_path: Path) -> None:
        (tmp_path / "deep.yaml").write_text(text)
        robot = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro"
            name="${xacro.load_yaml('deep.yaml')}"/>"""
        with pytest.raises(DescriptionError, match="nested more than 100 levels deep"):
            expand_text(robot, tmp_path / "r.xacro", root_dir=str(tmp_path)).require()

    def test_check_takes_it_for_a_file_without_controllers(self, text: str) -> None:
        assert compose(Source("c.yaml", text)) is None


def test_a_launch_file_with_a_null_character_is_refused() -> None:
    with pytest.raises(DescriptionError, match="the YAML cannot be read"):
        READERS["a launch file"]("launch: \0")


def test_as_many_levels_as_allowed_are_read() -> None:
    check_nesting("[" * MOST_LEVELS + "]" * MOST_LEVELS)
    with pytest.raises(yaml.YAMLError, match="line 1, column 101"):
        check_nesting("[" * (MOST_LEVELS + 1) + "]" * (MOST_LEVELS + 1))
