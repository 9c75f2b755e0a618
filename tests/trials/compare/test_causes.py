"""The edits that change a robot's behaviour are found among others that do not."""

import random
from collections.abc import Mapping
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.trials.compare.causes import Change, EffectKey, explain, minimal, relevant_changes
from kbot.trials.compare.edits import Edit, Edits
from kbot.trials.compare.model_equality import behaviour, is_same
from kbot.trials.compare.revisions import Description
from kbot.trials.compare.significance import Difference

from .generated_edits import (
    ARGUMENTS,
    CORPUS,
    FAULTS,
    KBOT,
    Robot,
    Texts,
    edit_harmlessly,
    faulty,
    texts_of,
    write,
)


@given(st.sets(st.integers(0, 30), min_size=1), st.integers(31, 40))
def test_halving_finds_exactly_the_items_that_are_needed_together(needed: set[int], count: int):
    assert set(minimal(range(count), needed.issubset)) == needed


@given(st.sets(st.integers(0, 20), min_size=1), st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20))))
def test_halving_gives_a_minimal_set_although_some_sets_are_unresolved(
    needed: set[int], follows: list[tuple[int, int]]
):
    """A set that has the first item of a pair without the second is unresolved."""

    def fails(some: tuple[int, ...]) -> bool:
        return needed <= set(some) and all(b in some for a, b in follows if a in some)

    found = minimal(tuple(range(21)), fails)
    assert fails(found)
    assert not any(fails(tuple(item for item in found if item != left)) for left in found)


def test_halving_ends_after_a_number_of_tries():
    calls: list[int] = []

    def fails(some: tuple[int, ...]) -> bool:
        calls.append(len(some))
        return set(range(0, 1000, 2)) <= set(some)

    left = minimal(tuple(range(1000)), fails, 50)
    assert set(range(0, 1000, 2)) <= set(left)
    assert len(calls) < 2 * 50 + 64


def test_many_changes_are_simulated_in_groups_of_neighbours(tmp_path: Path):
    rows = range(40)
    before = "".join(
        f'  <link name="l{n}"/>\n  <joint name="j{n}" type="fixed"><parent link="base"/><child link="l{n}"/>'
        f'<origin xyz="{n} 0 0"/></joint>\n'
        for n in rows
    )
    head, tail = '<robot name="r">\n  <link name="base"/>\n', "</robot>\n"
    found = relevant(tmp_path, f"{head}{before}{tail}", f"{head}{before.replace(' 0 0', ' 0.5 0')}{tail}")
    assert 1 < len(found) <= 12
    assert [line for change in found for line, *_ in change] == [4 + 2 * n for n in rows]


def hidden_faults(
    robot: Robot, kind: str, before: Description, after: Description, original: Texts
) -> tuple[Path, int] | None:
    """Write a fault of this kind among three to five harmless edits. Returns its place, or None if the robot
    has no such place."""
    rng = random.Random(f"{robot.name} {kind}")
    texts = dict(original)
    for _ in range(rng.randint(3, 5)):
        edit_harmlessly(rng, texts)
    one = before.load().require()
    for path, line, changed in faulty(rng, texts, kind):
        write(changed)
        loaded = after.load()
        if not loaded.has_errors and not is_same(behaviour(one), behaviour(loaded.require())):
            return path, line
    return None


@pytest.mark.parametrize("robot", [KBOT, *CORPUS], ids=lambda robot: robot.name)
def test_a_fault_is_found_among_harmless_edits(
    robot: Robot, tmp_path: Path, request: pytest.FixtureRequest, no_packages: None
):
    shared = None if robot is KBOT else request.getfixturevalue("shared")
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    before = robot.copy(shared, tmp_path / "a" / "robot")
    after = robot.copy(shared, tmp_path / "b" / "robot")
    ARGUMENTS[after.file] = robot.arguments
    original, done = texts_of(after), 0
    for kind in FAULTS:
        place = hidden_faults(robot, kind, before, after, original)
        if place is not None:
            changes = relevant_changes(Edits(before, after))
            assert [(Path(e.file), e.line) for c in changes for e in c.lines] == [place], kind
            done += 1
        write(original)
    assert done >= (20 if robot is KBOT else 8)


PROPERTY = '<xacro:property name="width" value="'
URDF = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="width" value="0.3"/>
  <link name="base"/>
  <link name="left"/>
  <joint name="j" type="continuous">
    <parent link="base"/>
    <child link="left"/>
    <origin xyz="0 ${width} 0"/>
  </joint>
  <gazebo reference="left">
    <mu1>0.5</mu1>
  </gazebo>
</robot>
"""


def relevant(tmp_path: Path, before: str, after: str) -> list[list[tuple[int, int, str, str]]]:
    """The relevant changes between two texts: line, column, and both texts."""
    sides = []
    for name, text in (("a", before), ("b", after)):
        (tmp_path / f"{name}.xacro").write_text(text)
        sides.append(Description(name, str(tmp_path / f"{name}.xacro")))
    changes = relevant_changes(Edits(*sides))
    return [[(e.line, e.column, e.before, e.after) for e in change.lines] for change in changes]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            '"0.3"',
            '"0.35"',
            [[(2, 42, f"{PROPERTY}0.3\"/>", f"{PROPERTY}0.35\"/>")]],
        ),
        ("<mu1>0.5</mu1>", "<mu1>0.6</mu1>", [[(11, 12, "<mu1>0.5</mu1>", "<mu1>0.6</mu1>")]]),
        # a deletion is at the line that follows
        ("    <mu1>0.5</mu1>\n", "", [[(11, 3, "<mu1>0.5</mu1>", "")]]),
        ("  <gazebo", "  <link/>\n  <gazebo".replace("link", "disable"), [[(10, 3, "", "<disable/>")]]),
        # a new name that is used in a different way is a single change
        ("width", "span", []),
    ],
)  # fmt: skip
def test_the_place_of_a_change(tmp_path: Path, old: str, new: str, expected: object):
    assert relevant(tmp_path, URDF, URDF.replace(old, new)) == expected


def test_two_faults_are_two_changes(tmp_path: Path):
    after = URDF.replace('"0.3"', '"0.4"').replace("0.5", "0.6").replace('name="left"/>', 'name="left"  />')
    assert [[line for line, *_ in change] for change in relevant(tmp_path, URDF, after)] == [[2], [11]]


def test_a_change_that_needs_another_one_is_one_change(tmp_path: Path):
    after = URDF.replace('"0 ${width} 0"', '"0 ${width + gap} 0"').replace(
        '  <link name="base"/>', '  <xacro:property name="gap" value="0.1"/>\n  <link name="base"/>'
    )
    assert [[line for line, *_ in change] for change in relevant(tmp_path, URDF, after)] == [[3, 9]]


def test_elements_in_another_order_are_not_a_change(tmp_path: Path):
    joint = URDF[URDF.index("  <joint") : URDF.index("  <gazebo")]
    moved = URDF.replace(joint, "").replace("</robot>", f"{joint}</robot>").replace("width", "span")
    assert relevant(tmp_path, URDF, moved) == []
    assert [[line for line, *_ in c] for c in relevant(tmp_path, URDF, moved.replace("0.5", "0.6"))] == [[6]]
    moved_width = moved.replace('"0 ${span} 0"', '"0 ${1.1*span} 0"')
    assert [[line for line, *_ in c] for c in relevant(tmp_path, URDF, moved_width)] == [[11]]


MACRO = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="wheel" params="side y">
    <link name="${side}"/>
    <joint name="${side}" type="continuous">
      <parent link="base"/>
      <child link="${side}"/>
      <origin xyz="0 ${y} 0"/>
    </joint>
  </xacro:macro>
  <link name="base"/>
  <xacro:wheel side="left" y="0.2"/>
  <xacro:wheel side="right" y="-0.2"/>
</robot>
"""


@pytest.mark.parametrize(("right", "expected"), [("-0.2", []), ("-0.21", [[12]])])
def test_a_parameter_that_a_macro_and_its_calls_have_is_not_a_change(
    tmp_path: Path, right: str, expected: list[list[int]]
):
    after = MACRO.replace('"side y"', '"side y z"').replace("${y} 0", "${y} ${z}")
    after = after.replace('y="0.2"', 'y="0.2" z="0"')
    after = after.replace('y="-0.2"', f'y="{right}" z="0.0"')
    assert [[line for line, *_ in change] for change in relevant(tmp_path, MACRO, after)] == expected


def test_attributes_in_another_order_in_several_lines_are_not_a_change(tmp_path: Path):
    before = URDF.replace('"0 ${width} 0"', '"0 ${width} 0"\n            rpy="0 0 0.5"')
    after = URDF.replace('xyz="0 ${width} 0"', 'rpy="0 0 0.5"\n            xyz="0 ${width} 0"')
    assert relevant(tmp_path, before, after) == []
    assert [
        [line for line, *_ in c] for c in relevant(tmp_path, before, after.replace('"0.3"', '"0.4"'))
    ] == [[2]]


def test_two_faults_in_several_files_are_found_among_harmless_edits(tmp_path: Path, no_packages: None):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    before, after = (KBOT.copy(None, tmp_path / name / "robot") for name in ("a", "b"))
    ARGUMENTS[after.file] = KBOT.arguments
    original = texts_of(after)
    for kinds in (("argument", "friction"), ("caster x", "torque"), ("moment", "noise")):
        rng, texts = random.Random(" ".join(kinds)), dict(original)
        for _ in range(5):
            edit_harmlessly(rng, texts)
        places = []
        for kind in kinds:
            path, line, texts = next(faulty(rng, texts, kind))
            places.append((path, line))
        write(texts)
        changes = relevant_changes(Edits(before, after))
        assert sorted((Path(e.file), e.line) for c in changes for e in c.lines) == sorted(places)
        write(original)


# --- effects -------------------------------------------------------------------------------------


def changes_of(count: int) -> list[Change]:
    return [Change((Edit("b", line, 1, "", "", ("", ""), ("", ""), ()),)) for line in range(1, count + 1)]


class Simulations:
    """Effects by rule: each rule is the lines that are needed, the measure, and the size."""

    def __init__(self, *rules: tuple[set[int], str, float]) -> None:
        self.rules, self.calls = rules, list[set[int]]()

    def __call__(self, edits: frozenset[Edit]) -> Mapping[EffectKey, Difference]:
        lines = {edit.line for edit in edits}
        self.calls.append(lines)
        sizes: dict[str, float] = {}
        for needed, name, size in self.rules:
            if needed <= lines:
                sizes[name] = sizes.get(name, 0.0) + size
        names = {name for _, name, _ in self.rules}
        # with a threshold of 1, the difference is the size
        return {("drive", n): Difference("drive", n, "m", 0.0, sizes.get(n, 0.0), 1.0) for n in names}


def found(count: int, simulations: Simulations) -> list[tuple[list[int], list[str]]]:
    causes = explain(changes_of(count), simulations)
    return [
        ([e.line for c in cause.changes for e in c.edits], sorted(m for _, m in cause.effects))
        for cause in causes
    ]


def test_each_change_has_its_measures_and_the_strongest_is_first():
    simulations = Simulations(
        ({1}, "drift", 2.0), ({3}, "drift", 5.0), ({3}, "energy", 4.0), ({2}, "yaw", 0.5)
    )
    assert found(3, simulations) == [([3], ["drift", "energy"]), ([1], ["drift"])]


def test_an_effect_that_needs_two_changes_is_an_interaction():
    simulations = Simulations(({2, 4}, "tips over", 9.0), ({1}, "drift", 3.0))
    assert found(5, simulations) == [([2, 4], ["tips over"]), ([1], ["drift"])]
    assert len(simulations.calls) == len({frozenset(lines) for lines in simulations.calls}), "no run twice"


def test_without_a_significant_effect_nothing_is_simulated_again():
    simulations = Simulations(({1}, "drift", 0.5))
    assert found(3, simulations) == []
    assert simulations.calls == [{1, 2, 3}]


def test_a_single_change_needs_a_single_simulation():
    simulations = Simulations(({1}, "drift", 5.0))
    assert found(1, simulations) == [([1], ["drift"])]
    assert simulations.calls == [{1}]


def test_small_effects_that_only_add_up_are_an_interaction():
    simulations = Simulations(({1}, "drift", 0.6), ({2}, "drift", 0.6), ({3}, "yaw", 2.0))
    assert found(3, simulations) == [([3], ["yaw"]), ([1, 2], ["drift"])]
