"""Tests the limits of the YAML reader for all its callers, and the positions of values and errors."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from kbot.cli.ros.graph.common import read_values_text as read_word
from kbot.ros.launch.reporter import Reporter
from kbot.ros.launch.ros2.markup import read_yaml_launch as read_launch
from kbot.ros.parameter_values import ROSPARAM
from kbot.text import DescriptionError, KbotError, Source
from kbot.text.yaml import MOST_LEVELS, PLAIN, TEXT, Dialect, YamlError, check_nesting, load_yaml, read_yaml
from kbot.workbench.displays.marked_yaml import read_marked as read_rviz
from kbot.world.occupancy_files import read_map
from kbot.xacro import Packages, expand_text

READERS: dict[str, Callable[[str], object]] = {
    "load_yaml": load_yaml,
    "all values as texts": lambda text: read_yaml(Source("t.yaml", text), TEXT),
    "a node's parameters": lambda text: read_yaml(Source("p.yaml", text), ROSPARAM),
    "a launch file": lambda text: read_launch(Source("l.yaml", text), Reporter(Packages())),
    "a view of RViz": lambda text: read_rviz(text, "v.rviz"),
    "a word of a command line": lambda text: read_word(text, "--value", "1"),
}


@pytest.mark.parametrize("text", ["[" * 100_000, "{a: " * 100_000, "a: &x " + "[" * 100_000])
class TestDeepNesting:
    @pytest.mark.parametrize("reader", READERS)
    def test_hostile_yaml_is_rejected(self, reader: str, text: str) -> None:
        with pytest.raises((YamlError, KbotError), match=r"nested|recursion"):
            READERS[reader](text)

    def test_a_hostile_map_is_rejected(self, text: str, tmp_path: Path) -> None:
        (tmp_path / "map.yaml").write_text(text)
        with pytest.raises(KbotError, match="nested more than 100 levels deep"):
            read_map(tmp_path / "map.yaml")

    def test_xacro_rejects_hostile_yaml(self, text: str, tmp_path: Path) -> None:
        (tmp_path / "deep.yaml").write_text(text)
        robot = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro"
            name="${xacro.load_yaml('deep.yaml')}"/>"""
        with pytest.raises(DescriptionError, match="nested more than 100 levels deep"):
            expand_text(robot, tmp_path / "r.xacro", root_dir=str(tmp_path)).require()


def test_a_launch_file_with_a_null_character_is_rejected() -> None:
    with pytest.raises(DescriptionError, match="the YAML cannot be read"):
        READERS["a launch file"]("launch: \0")


def test_as_many_levels_as_allowed_are_read() -> None:
    check_nesting("[" * MOST_LEVELS + "]" * MOST_LEVELS)
    with pytest.raises(yaml.YAMLError, match="line 1, column 101"):
        check_nesting("[" * (MOST_LEVELS + 1) + "]" * (MOST_LEVELS + 1))


ALIASES = "a0: &a0\n- let: {name: a, value: b}\n" + "".join(
    f"a{i}: &a{i}\n" + f"- group: *a{i - 1}\n" * 9 for i in range(1, 20)
)
"""Twenty lists that stand for 9**19 values."""
LARGE = 2**61 - 1
"""Its multiples have one hash."""


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("text", [f"{ALIASES}launch: *a19\n", "launch: &a [group: *a]", "launch: &a {a: *a}"])
def test_aliases_that_stand_for_too_many_values_are_rejected(reader: str, text: str) -> None:
    with pytest.raises((YamlError, KbotError), match="too many values"):
        READERS[reader](text)


def test_aliases_that_nest_too_deeply_are_rejected() -> None:
    text = "a0: &a0 [1]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 200))
    with pytest.raises(YamlError, match="its aliases"):
        load_yaml(text)


def test_a_document_with_too_many_values_is_rejected() -> None:
    def read(text: str) -> Any:
        return read_yaml(Source("a.yaml", text), PLAIN, 20).data

    assert read(f"[{'1, ' * 18}1]") == [1] * 19
    for text in ("[" + "1, " * 30 + "]", "[" + "1, " * 60 + "]"):
        with pytest.raises(YamlError, match="more than 20 values"):
            read(text)
    with pytest.raises(yaml.YAMLError, match="more than 20 values"):
        check_nesting("[" + "1, " * 60 + "]", 20)


def test_keys_that_may_share_one_hash_are_rejected() -> None:
    assert len(load_yaml("".join(f"{k * LARGE}: 1\n" for k in range(100)))) == 100
    merged = "a: &a {" + ", ".join(f"{k * LARGE}: 1" for k in range(200)) + "}\n"
    for text in (merged, f"{merged}b: {{<<: *a}}\n"):
        with pytest.raises(YamlError, match="over 18 digits as keys"):
            load_yaml(text)


XACRO_REFUSES = {
    "aliases of one long list": (
        "a: &a [" + "1," * 60_000 + "1]\nb: [" + "*a," * 60_000 + "*a]\n",
        "contains too much data",
    ),
    "keys that can have one hash": (
        "".join(f"{k * LARGE}: 1\n" for k in range(1, 200)),
        "over 18 digits as keys",
    ),
    "such keys in escapes of characters": (
        "%TAG ! tag:yaml.org,2002:in\n---\n{"
        + ",".join(f'!t "\\x3{str(k * LARGE)[0]}{str(k * LARGE)[1:]}": 1' for k in range(1, 200))
        + "}\n",
        "over 18 digits as keys",
    ),
    "a long number to the base of 60": ("a: " + "1:" * 200_000 + "1", "a number is too large"),
    "a large number to the base of 60": (
        "a: " + "1:" * 200_000 + "1.5",
        r"h\.yaml:1:4 is not valid YAML: .* is not a valid",
    ),
    "a number without digits": ("a: !!int ''", r"h\.yaml:1:4 is not valid YAML: .* is not a valid"),
}


@pytest.mark.parametrize("what", XACRO_REFUSES)
def test_xacro_rejects_too_expensive_yaml(what: str, tmp_path: Path) -> None:
    text, error = XACRO_REFUSES[what]
    (tmp_path / "h.yaml").write_text(text)
    robot = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="${xacro.load_yaml('h.yaml')}"/>"""
    with pytest.raises(DescriptionError, match=error):
        expand_text(robot, tmp_path / "r.xacro", root_dir=str(tmp_path)).require()


TEXT_WITH_PLACES = """\
base: &b {k: 1, l: [é, 7]}
merged: {<<: *b, m: 2}
yes: 3
alias: *b
"""


@pytest.mark.parametrize(
    ("keys", "place"),
    [
        ((), (1, 1)),
        (("base", "l", "1"), (1, 24)),
        (("merged", "k"), (1, 11)),  # at the anchor
        (("merged", "m"), (2, 18)),
        (("True",), (3, 1)),  # YAML 1.1 reads it as a truth value
        (("alias",), (4, 1)),
        (("alias", "l", "0"), (1, 21)),
        (("merged", "absent", "x"), (2, 1)),  # the nearest value above it
    ],
)
def test_each_value_has_a_span(keys: tuple[str, ...], place: tuple[int, int]) -> None:
    span = read_yaml(Source("a.yaml", TEXT_WITH_PLACES)).span(*keys)
    assert (span.line, span.column) == place


def test_a_place_has_the_spans_of_a_key_and_its_value() -> None:
    document = read_yaml(Source("a.yaml", TEXT_WITH_PLACES))
    place = document.place("merged", "m")
    assert place is not None
    assert place.key is not None
    assert (place.key.text, place.value.text) == ("m", "2")
    assert document.place("merged", "absent") is None
    assert read_yaml(Source("a.yaml", "")).place() is None


@pytest.mark.parametrize(
    ("text", "problem", "place"),
    [
        (
            "a: 1\nb: [",
            "while parsing a flow node, expected the node content, but found '<stream end>'",
            (2, 5),
        ),
        ("a: 1\nb: !!int ''", '"" is not a valid int', (2, 4)),
        ("a: 1\nb: 2020-13-45", '"2020-13-45" is not a valid timestamp', (2, 4)),
        ("a: 1\n? [b]\n: 1", "while constructing a mapping, found unhashable key", (2, 3)),
        ("a: 1\nb: !half x", "could not convert string to float: 'x'", (2, 4)),
        ("a: \0", "unacceptable character #x0000", (1, 1)),
        ("---\n1\n---\n2", "expected a single document in the stream, but found another document", (3, 1)),
    ],
)
def test_an_error_has_a_place(text: str, problem: str, place: tuple[int, int]) -> None:
    dialect = Dialect({"!half": lambda text: float(text) / 2})
    with pytest.raises(YamlError) as caught:
        read_yaml(Source("a.yaml", text), dialect)
    assert caught.value.problem.startswith(problem)
    assert (caught.value.span.line, caught.value.span.column) == place


def test_a_dialect_defines_the_types_of_scalars() -> None:
    assert read_yaml(Source("a.yaml", "a: [1, yes, 2020-01-01]"), TEXT).data == {
        "a": ["1", "yes", "2020-01-01"]
    }
    assert load_yaml("!degrees 180", Dialect({"!degrees": lambda text: math.radians(float(text))})) == math.pi


def test_texts_that_only_the_loader_in_python_accepts_are_read() -> None:
    document = read_yaml(Source("a.yaml", "b: |\n  \tc\na: {b:{c: 1}}\n"))
    assert document.data == {"b": "\tc\n", "a": {"b": {"c": 1}}}
    assert document.span("a", "b", "c").column == 8


def test_limits_apply_to_the_loader_in_python_too() -> None:
    for text in ("[" * 101 + "a:{b: 1}", "{a:{b: &b [*b]}}"):
        with pytest.raises(YamlError, match=r"it is nested more than 100 levels deep|too many values"):
            load_yaml(text)


@pytest.mark.parametrize("dialect", [PLAIN, TEXT])
def test_repeated_keys_are_found_at_each_level(dialect: Dialect) -> None:
    text = "a: {b: 1, c: 2, 'b': 3}\nd: [{e: 1, e: 2, e: 3}]\na: 4\n"
    document = read_yaml(Source("a.yaml", text), dialect)
    assert sorted((span.line, span.column) for span in document.repeated_keys()) == [
        (1, 17), (2, 12), (2, 18), (3, 1),
    ]  # fmt: skip


def test_a_key_of_a_merged_mapping_may_be_replaced() -> None:
    text = "base: &base {b: 1, c: 2}\nown: {<<: *base, b: 3}\nboth: [*base, *base]\n"
    document = read_yaml(Source("a.yaml", text))
    assert document.data["own"] == {"b": 3, "c": 2}
    assert list(document.repeated_keys()) == []
