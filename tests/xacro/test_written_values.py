"""Tests the edits that give parameters and attributes other values. Each is verified by an expansion."""

import csv
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.text import DescriptionError, Element, KbotError
from kbot.text.edits import edited_texts
from kbot.text.files import unsaved
from kbot.xacro import Expansion, expand
from kbot.xacro.written_values import (
    ValueEdits,
    WantedValue,
    attribute_edits,
    number_text,
    parameter_edits,
    written_parameters,
)

ROBOT = """<?xml version="1.0"?>
<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <!-- a comment that stays -->
  <xacro:arg name="height" default="0.30"/>
  <xacro:property name="wheel_diameter" value="0.080"/>  <!-- of the tyre -->
  <xacro:property name="track" value="0.2"/>
  <xacro:property name="density" value="1e3"/>
  <xacro:property name="camera_xyz" value="0.1 0 ${$(arg height) + 0.05}"/>
  <xacro:property name="side_gap" value="0.01"/>
  <xacro:macro name="wheel" params="side reflect *origin radius:=${wheel_diameter/2} width:=0.02">
    <link name="${side}_wheel">
      <visual><geometry><cylinder radius="${radius}" length="${width}"/></geometry></visual>
      <inertial><mass value="${density * pi * radius**2 * width}"/></inertial>
    </link>
    <joint name="${side}_joint">
      <xacro:insert_block name="origin"/>
      <axis xyz="0 1 0"/>
      <offset y="${reflect * (track/2 + side_gap)}"/>
    </joint>
  </xacro:macro>
  <xacro:wheel side="left" reflect="1"><origin xyz="0 ${track/2} ${wheel_diameter/2}"/></xacro:wheel>
  <xacro:wheel side="right" reflect="-1"><origin xyz="0 ${-track/2} ${wheel_diameter/2}"/></xacro:wheel>
  <link name="camera"/>
  <joint name="camera_joint"><origin xyz="${camera_xyz}" rpy="0 ${radians(10)} -${side_gap}"/></joint>
  <gazebo>
    <plugin>
      <wheel_separation>${track}</wheel_separation>
      <wheel_radius> 0.04 </wheel_radius>
      <height>$(arg height)</height>
    </plugin>
  </gazebo>
</robot>
"""


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    (tmp_path / "r.xacro").write_text(ROBOT)
    return tmp_path / "r.xacro"


def element(expansion: Expansion, owner: str, tag: str) -> Element:
    """The first element with a tag in the link or joint with a name, or in the element `gazebo`."""
    assert expansion.document is not None
    return next(
        part
        for top in expansion.document.elements()
        if top.attributes.get("name", top.tag) == owner
        for part in top.descendants()
        if part.tag == tag
    )


def edited(found: ValueEdits, text: str = ROBOT) -> str:
    """The edited text of the only file."""
    ((_, after),) = edited_texts(found.edits).values()
    assert text != after
    return after


@pytest.mark.parametrize(
    ("owner", "tag", "attribute", "index", "value", "old", "new"),
    [
        # through a parameter's default and a division
        ("left_wheel", "cylinder", "radius", 0, 0.035, 'value="0.080"', 'value="0.07"'),
        ("left_wheel", "cylinder", "length", 0, 0.03, "width:=0.02", "width:=0.03"),
        # a block, a sign, and a term that the fewest attributes depend on
        ("right_joint", "origin", "xyz", 1, -0.12, '"track" value="0.2"', '"track" value="0.24"'),
        ("left_joint", "offset", "y", 0, 0.13, '"side_gap" value="0.01"', '"side_gap" value="0.03"'),
        ("right_joint", "offset", "y", 0, -0.13, '"side_gap" value="0.01"', '"side_gap" value="0.03"'),
        ("camera_joint", "origin", "rpy", 2, -0.02, '"side_gap" value="0.01"', '"side_gap" value="0.02"'),
        # a property with three words, and an expression with only a number
        ("camera_joint", "origin", "xyz", 0, -0.1, 'value="0.1 0', 'value="-0.1 0'),
        ("camera_joint", "origin", "xyz", 2, 0.45, 'default="0.30"', 'default="0.4"'),
        ("camera_joint", "origin", "rpy", 0, 1.5, 'rpy="0 ', 'rpy="1.5 '),
        # texts of elements, with and without an expression
        ("gazebo", "wheel_separation", "", 0, 0.3, '"track" value="0.2"', '"track" value="0.3"'),
        ("gazebo", "wheel_radius", "", 0, 0.045, "> 0.04 <", "> 0.045 <"),
        ("gazebo", "height", "", 0, 0.5, 'default="0.30"', 'default="0.5"'),
        # a square: no factor has the unit of the value, so the fewest uses decide
        (
            "left_wheel",
            "mass",
            "value",
            0,
            0.2,
            'value="1e3"',
            f'value="{0.2 / (math.pi * 0.04**2 * 0.02)!r}',
        ),
    ],
)
def test_the_number_that_defines_a_value_is_edited(
    robot: Path, owner: str, tag: str, attribute: str, index: int, value: float, old: str, new: str
) -> None:
    expansion = expand(robot)
    found = attribute_edits(expansion, [WantedValue(element(expansion, owner, tag), attribute, value, index)])
    if "pi" in new or tag == "mass":
        assert len(found.edits) == 1
        number = found.edits[0]
        assert number.span.text == "1e3"
        assert float(number.replacement) == pytest.approx(0.2 / (math.pi * 0.04**2 * 0.02), rel=1e-12)
        assert "e" in number.replacement
    else:
        assert edited(found) == ROBOT.replace(old, new)


def test_values_that_change_too_are_listed(robot: Path) -> None:
    expansion = expand(robot)
    want = WantedValue(element(expansion, "left_wheel", "cylinder"), "radius", 0.05)
    others = [
        (other.title.partition(" (")[0], other.before, other.after)
        for other in attribute_edits(expansion, [want]).others
    ]
    assert others == [
        ("'value' of <mass> in link 'left_wheel'", "0.10053096491487339", "0.15707963267948968"),
        ("'xyz' of <origin> in joint 'left_joint'", "0 0.1 0.04", "0 0.1 0.05"),
        ("'radius' of <cylinder> in link 'right_wheel'", "0.04", "0.05"),
        ("'value' of <mass> in link 'right_wheel'", "0.10053096491487339", "0.15707963267948968"),
        ("'xyz' of <origin> in joint 'right_joint'", "0 -0.1 0.04", "0 -0.1 0.05"),
    ]


def test_several_values_are_changed_together(robot: Path) -> None:
    """`track` for the joints, and then the gap, because the offsets depend on both."""
    expansion = expand(robot)
    wanted = [
        WantedValue(element(expansion, "left_joint", "offset"), "y", 0.14),
        WantedValue(element(expansion, "right_joint", "offset"), "y", -0.14),
        WantedValue(element(expansion, "left_joint", "origin"), "xyz", 0.12, 1),
        WantedValue(element(expansion, "left_wheel", "cylinder"), "radius", 0.035),
    ]
    text = edited(attribute_edits(expansion, wanted))
    assert text == ROBOT.replace("0.080", "0.07").replace('"0.2"', '"0.24"').replace('"0.01"', '"0.02"')


def test_no_edit_for_the_present_value(robot: Path) -> None:
    expansion = expand(robot)
    want = WantedValue(element(expansion, "left_wheel", "cylinder"), "radius", 0.04)
    assert attribute_edits(expansion, [want]) == ValueEdits((), ())


def refused(expansion: Expansion, *wanted: WantedValue) -> str:
    with pytest.raises(KbotError) as error:
        attribute_edits(expansion, wanted)
    return str(error.value)


def test_one_number_cannot_have_two_values(robot: Path) -> None:
    expansion = expand(robot)
    left = WantedValue(element(expansion, "left_wheel", "cylinder"), "radius", 0.05)
    right = WantedValue(element(expansion, "right_wheel", "cylinder"), "radius", 0.06)
    place = f"{robot}:12:43"
    assert refused(expansion, left, right) == (
        f"the value of 'wheel_diameter' ({robot}:5:48) would need two values: 0.1 for 'radius' of "
        f"<cylinder> in link 'left_wheel' ({place}), and another one to make 'radius' of <cylinder> in "
        f"link 'right_wheel' ({place}) 0.06. Define the two values separately"
    )
    keep = WantedValue(right.element, "radius", 0.04)
    assert "would need two values" in refused(expansion, left, keep)


def test_values_that_no_number_gives_are_refused(robot: Path) -> None:
    expansion = expand(robot, {"height": "1"})
    mass = element(expansion, "left_wheel", "mass")
    axis = element(expansion, "left_joint", "axis")
    wheel = element(expansion, "left_wheel", "cylinder")
    link = element(expansion, "left_wheel", "visual")
    height = element(expansion, "gazebo", "height")
    assert "does not exist" in refused(expansion, WantedValue(mass, "weight", 1.0))
    assert "does not exist" in refused(expansion, WantedValue(link, "", 1.0))
    assert "is not a number" in refused(expansion, WantedValue(axis, "xyz", 1.0, 3))
    assert "whose value is given" in refused(expansion, WantedValue(height, "", 2.0))
    assert "no number in the files" in refused(expansion, WantedValue(mass, "value", math.inf))
    assert attribute_edits(expansion, [WantedValue(wheel, "length", 0.5)]).edits


def test_expressions_that_cannot_be_inverted_are_refused(tmp_path: Path) -> None:
    (tmp_path / "sizes.yaml").write_text("wheel: 0.1\n")
    file = tmp_path / "r.xacro"
    file.write_text(
        """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="count" value="3"/>
  <xacro:property name="sizes" value="${xacro.load_yaml('sizes.yaml')}"/>
  <a square="${count * count}" yaml="${sizes['wheel']}" word="${'2' + '1'}" whole="${int(count)}"/>
</robot>"""
    )
    expansion = expand(file)
    assert expansion.document is not None
    a = next(expansion.document.elements())
    assert "depends on data in 'sizes'" in refused(expansion, WantedValue(a, "yaml", 0.2))
    for attribute, value in (("square", -1.0), ("word", 3.0), ("whole", 2.5)):
        assert "no number in the files" in refused(expansion, WantedValue(a, attribute, value))
    (edit,) = attribute_edits(expansion, [WantedValue(a, "square", 16.0)]).edits
    assert edit.replacement == "4"


def test_a_value_that_changes_the_elements_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "r.xacro"
    file.write_text(
        """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="size" value="3"/>
  <a size="${size}"/>
  <xacro:if value="${size > 4}"><b/></xacro:if>
</robot>"""
    )
    expansion = expand(file)
    a = next(expansion.require().document.elements())  # type: ignore[union-attr]
    assert "changes which elements" in refused(expansion, WantedValue(a, "size", 5.0))


numbers = st.integers(-10_000, 10_000).filter(bool).map(lambda n: n / 1000)


@given(
    numbers,
    numbers,
    st.sampled_from(["{x}", "{x}/2", "-{x}/2", "2*{x} + 0.5", "0.5 - 3*{x}", "-(0.25 + {x})*4"]),
    st.integers(0, 3),
)
def test_linear_expressions_are_inverted(x: float, value: float, expression: str, depth: int) -> None:
    """Through a chain of properties, arguments and macros: the value is exact, or differs by rounding."""
    lines = [f'<xacro:arg name="a" default="{x}"/><xacro:property name="x0" value="$(arg a)"/>']
    lines += [f'<xacro:property name="x{i + 1}" value="${{x{i}}}"/>' for i in range(depth)]
    shown = "${" + expression.format(x="p") + "}"
    lines.append(f'<xacro:macro name="m" params="p"><a b="1 {shown}" c="{shown}"/></xacro:macro>')
    lines.append(f'<xacro:m p="${{x{depth}}}"/>')
    text = "\n".join(['<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">', *lines, "</robot>"])
    with unsaved({"/r.xacro": text}):
        expansion = expand("/r.xacro")
        a = next(expansion.require().document.elements())  # type: ignore[union-attr]
        found = attribute_edits(expansion, [WantedValue(a, "b", value, 1)])
        after = edited_texts(found.edits)
        if not found.edits:
            assert float(a.attributes["c"]) == pytest.approx(value, rel=1e-9)
            return
        assert [edit.span.line for edit in found.edits] == [2]
        with unsaved({name: new for name, (_, new) in after.items()}):
            b = next(expand("/r.xacro").require().document.elements())  # type: ignore[union-attr]
    assert float(b.attributes["c"]) == pytest.approx(value, rel=1e-12)


# --- parameters ------------------------------------------------------------------------------


def test_only_plain_top_level_numbers_are_parameters(robot: Path) -> None:
    found = {(value.kind, value.name): value.value for value in written_parameters(expand(robot))}
    assert found == {
        ("arg", "height"): 0.3,
        ("property", "wheel_diameter"): 0.08,
        ("property", "track"): 0.2,
        ("property", "density"): 1000.0,
        ("property", "side_gap"): 0.01,
    }


@pytest.mark.parametrize(
    ("value", "like", "text"),
    [
        (0.05, "", "0.05"), (1.0, "", "1"), (1e-5, "", "0.00001"), (-2.5, "3", "-2.5"),
        (0.1 + 0.2, "", "0.30000000000000004"), (0.06, "0.050", "0.06"), (2.0, "1.0", "2.0"),
        (12.0, "10", "12"), (0.5, ".25", "0.5"), (1e-9, "1", "1e-09"), (2500.0, "1e3", "2.5e3"),
        (0.0, "1.0", "0.0"), (3e12, "1", "3e+12"), (0.02, "1E-2", "2E-2"), (1.0, "5.", "1.0"),
    ],
)  # fmt: skip
def test_numbers_are_written_in_the_notation_of_the_file(value: float, like: str, text: str) -> None:
    assert number_text(value, like) == text
    assert float(text) == value


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(["", "1", "0.050", "1e3", "2.5E-3"]))
def test_a_number_keeps_its_value_in_any_notation(value: float, like: str) -> None:
    assert float(number_text(value, like)) == value


def edited_files(
    path: Path, arguments: dict[str, float | str], properties: dict[str, float | str]
) -> dict[str, str]:
    """The edited texts by the name of the file."""
    edits = [found.edit for found in parameter_edits(str(path), arguments, properties).edits]
    return {Path(name).name: after for name, (_, after) in edited_texts(edits).items()}


def test_parameters_are_changed_where_they_are_defined(robot: Path) -> None:
    after = edited_files(robot, {"height": 0.4, "unknown": 1.0}, {"wheel_diameter": 0.09, "density": 2000.0})
    assert after == {"r.xacro": ROBOT.replace("0.30", "0.4").replace("0.080", "0.09").replace("1e3", "2e3")}
    assert edited_files(robot, {"height": 0.3}, {}) == {}
    with pytest.raises(DescriptionError, match="wheel_diameter"):
        edited_files(robot, {}, {"wheel_diametre": 0.09})


def test_a_computed_property_becomes_a_plain_value_in_the_file_that_defines_it(tmp_path: Path) -> None:
    (tmp_path / "sizes.xacro").write_text(
        """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="radius" value="${diameter/2}"/>
</robot>"""
    )
    file = tmp_path / "r.xacro"
    file.write_text(
        """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="diameter" value="0.1"/>
  <xacro:property name="label" value="small"/>
  <xacro:include filename="sizes.xacro"/>
  <a b="${radius}" c="${diameter}" d="${label}"/>
</robot>"""
    )
    texts = edited_files(file, {}, {"radius": 0.06, "label": 'a "b" & c'})
    assert 'name="radius" value="0.06"' in texts["sizes.xacro"]
    assert 'value="a &quot;b&quot; &amp; c"' in texts["r.xacro"]


def test_each_definition_of_a_property_is_changed(tmp_path: Path) -> None:
    file = tmp_path / "r.xacro"
    text = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="large" default="true"/>
  <xacro:property name="size" value="1"/>
  <a size="${size}"/>
  <xacro:if value="$(arg large)"><xacro:property name="size" value="2"/></xacro:if>
  <xacro:unless value="$(arg large)"><xacro:property name="size" value="4"/></xacro:unless>
  <b size="${size}"/>
</robot>"""
    file.write_text(text)
    after = edited_files(file, {}, {"size": 3.0})
    assert after == {"r.xacro": text.replace('"1"', '"3"').replace('"2"', '"3"')}
    after = edited_files(file, {"large": "false"}, {"size": 3.0})
    assert after == {"r.xacro": text.replace('"1"', '"3"').replace('"4"', '"3"').replace("true", "false")}


ATTRIBUTES = {"origin": ("xyz",), "cylinder": ("radius", "length"), "box": ("size",), "mass": ("value",)}

# --- real robots -----------------------------------------------------------------------------


@pytest.mark.parametrize("part", range(4))
def test_sizes_and_places_of_real_robots_are_changed(shared: Path, part: int) -> None:
    """A number is changed, so that another expansion has the wanted value, or the reason is data in YAML."""
    corpus = shared / "corpus"
    rows = list(csv.DictReader((corpus / "manifest.csv").read_text().splitlines()))[part::16]
    changed, reasons = 0, []
    for row in rows:
        path = corpus / "src" / row["repo"].replace("/", "+") / row["entry"]
        words = (word.partition(":=") for word in row["args"].split())
        expansion = expand(path, {name: value for name, _, value in words})
        if not expansion.ok:
            continue  # it needs packages that the corpus has elsewhere
        slots = [
            WantedValue(part, attribute, 1.25 * float(word) + 0.01, index)
            for part in expansion.require().document.descendants()  # type: ignore[union-attr]
            for attribute in ATTRIBUTES.get(part.tag, ())
            for index, word in enumerate(part.attributes.get(attribute, "").split())
        ]
        for want in slots[:: len(slots) // 8 + 1]:
            try:
                changed += len(attribute_edits(expansion, [want]).edits)
            except KbotError as error:
                reasons.append(str(error))
    assert changed > 20
    assert [reason for reason in reasons if "depends on data in" not in reason] == []
