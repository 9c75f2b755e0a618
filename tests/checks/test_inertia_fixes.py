"""Fixes of inertials: in the call of the macro that makes them, with a macro, or as numbers."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kbot.checks import Config, check_text
from kbot.checks.facts.inertia_macros import find_macros
from kbot.checks.fixes import fixed
from kbot.model import Inertial
from kbot.model.load import load_robot_text
from kbot.text import Diagnostic
from kbot.xacro import expand_text

ONLY = Config(select=("I1", "X", "U", "P"), ignore=("I117", "I115"))
MACROS = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="box_inertia" params="m w h d">
    <inertial>
      <mass value="${m}"/>
      <inertia ixx="${m / 12.0 * (d*d + h*h)}" ixy="0" ixz="0"
               iyy="${m / 12.0 * (w*w + h*h)}" iyz="0" izz="${m / 12.0 * (w*w + d*d)}"/>
    </inertial>
  </xacro:macro>
  <xacro:macro name="cylinder_inertia" params="m r h rpy:='0 0 0'">
    <inertial>
      <origin xyz="0 0 0" rpy="${rpy}"/>
      <mass value="${m}"/>
      <inertia ixx="${m*(3*r*r+h*h)/12}" ixy="0" ixz="0" iyy="${m*(3*r*r+h*h)/12}" iyz="0"
               izz="${m*r*r/2}"/>
    </inertial>
  </xacro:macro>
  <xacro:macro name="rod_inertial" params="mass length radius *origin">
    <inertial>
      <xacro:insert_block name="origin"/>
      <mass value="${mass}"/>
      <inertia ixx="${0.0833333 * mass * (3*radius**2 + length**2)}" ixy="0" ixz="0"
               iyy="${0.0833333 * mass * (3*radius**2 + length**2)}" iyz="0" izz="${0.5*mass*radius**2}"/>
    </inertial>
  </xacro:macro>
"""
TURNED = '<origin xyz="0 0 0" rpy="${pi/2} 0 0"/>'
lengths = st.sampled_from([0.01, 0.02, 0.05, 0.11, 0.3, 0.7])
masses = st.sampled_from([0.05, 0.4, 3.0])


def link(name: str, geometry: str, inertial: str, origin: str = "") -> str:
    shape = f"{origin}<geometry>{geometry}</geometry>"
    return (
        f'  <link name="{name}">\n    <visual>{shape}</visual>\n    <collision>{shape}</collision>\n'
        f"    {inertial}\n  </link>\n"
        f'  <joint name="to_{name}" type="continuous"><parent link="base"/><child link="{name}"/>'
        f'<axis xyz="0 1 0"/></joint>\n'
    )


def robot(*links: str, before: str = MACROS) -> str:
    return before + '  <link name="base"/>\n' + "".join(links) + "</robot>\n"


def check(text: str) -> tuple[Diagnostic, ...]:
    return check_text(text, "r.xacro", config=ONLY)


def all_fixed(text: str) -> str:
    """The text with all safe and unsafe fixes. A second fix must not change it."""
    done, *_ = fixed(text, "r.xacro", check, unsafe=True)
    assert fixed(done, "r.xacro", check, unsafe=True)[0] == done
    return done


def inertial_of(text: str, name: str) -> Inertial:
    inertial = load_robot_text(text, "r.xacro").require().links[name].inertial
    assert inertial is not None
    return inertial


def moments(text: str, name: str) -> tuple[float, float, float]:
    i = inertial_of(text, name)
    return i.ixx, i.iyy, i.izz


def box(mass: float, x: float, y: float, z: float) -> list[float]:
    return [mass / 12 * (y * y + z * z), mass / 12 * (x * x + z * z), mass / 12 * (x * x + y * y)]


@settings(max_examples=60)
@given(st.permutations([0.02, 0.11, 0.3]), masses, st.sampled_from([(0, 1), (0, 2), (1, 2)]))
def test_exchanged_arguments_are_fixed(sizes: list[float], mass: float, pair: tuple[int, int]) -> None:
    x, y, z = sizes
    given_sizes = list(sizes)
    given_sizes[pair[0]], given_sizes[pair[1]] = sizes[pair[1]], sizes[pair[0]]
    w, d, h = given_sizes
    plate = link(
        "plate",
        f'<box size="{x} {y} {z}"/>',
        f'<xacro:box_inertia m="{mass}" w="{w}" h="{h}" d="{d}"/>  <!-- weighed -->',
    )
    sound = link("sound", '<box size="1 2 3"/>', '<xacro:box_inertia m="1" w="1" h="3" d="2"/>')
    text = robot(plate, sound)
    assert [d.code for d in check(text)] == ["I112"]
    done = all_fixed(text)
    assert check(done) == ()
    assert done.startswith(MACROS)
    assert sound in done
    assert "<!-- weighed -->" in done
    assert moments(done, "plate") == pytest.approx(box(mass, x, y, z))


@pytest.mark.parametrize(
    ("call", "turned"),
    [
        (
            '<xacro:cylinder_inertia m="1" r="0.05" h="0.02"/>',
            '<xacro:cylinder_inertia m="1" r="0.05" h="0.02" rpy="${pi/2} 0 0"/>',
        ),
        (
            '<xacro:cylinder_inertia m="1" r="0.05" h="0.02" rpy="0 0 0" />',
            '<xacro:cylinder_inertia m="1" r="0.05" h="0.02" rpy="${pi/2} 0 0" />',
        ),
        (
            '<xacro:rod_inertial mass="1" radius="0.05" length="0.02"><origin xyz="0 0 0"/>'
            "</xacro:rod_inertial>",
            '<xacro:rod_inertial mass="1" radius="0.05" length="0.02"><origin xyz="0 0 0" rpy="${pi/2} 0 0"/>'
            "</xacro:rod_inertial>",
        ),
    ],
)
@pytest.mark.parametrize("others", [0, 1, 2])
def test_the_inertia_call_is_rotated_with_its_geometry(call: str, turned: str, others: int) -> None:
    cylinder = '<cylinder radius="0.05" length="0.02"/>'
    # other faulty links of the same macro are fixed too, and correct ones are not changed
    faulty = [link(f"wheel_{n}", cylinder, call, TURNED) for n in range(1 + others // 2)]
    sound = [link("sound", cylinder, turned, TURNED)] if others else []
    text = robot(*faulty, *sound)
    assert {d.code for d in check(text)} == {"I111"}
    assert all_fixed(text) == text.replace(call, turned)
    assert check(all_fixed(text)) == ()


@settings(max_examples=40)
@given(lengths, lengths, masses, st.sampled_from([1000.0, 100.0]))
def test_an_inertia_call_in_other_units_gets_the_sizes_of_its_shape(
    r: float, h: float, mass: float, unit: float
) -> None:
    sizes = f'<xacro:property name="r" value="{r}"/>\n'
    call = f'<xacro:cylinder_inertia m="{mass}" r="{r * unit}" h="{h * unit}" rpy="${{pi/2}} 0 0"/>'
    text = robot(
        link("wheel", f'<cylinder radius="${{r}}" length="{h}"/>', call, TURNED), before=MACROS + sizes
    )
    assert "I108" in {d.code for d in check(text)}
    done = all_fixed(text)
    assert check(done) == ()
    assert done.startswith(MACROS)
    assert 'r="${r}"' in done  # as the geometry has it
    across, _, along = moments(done, "wheel")
    assert (across, along) == pytest.approx((mass * (3 * r * r + h * h) / 12, mass * r * r / 2))


def test_an_inertial_is_replaced_by_a_call_of_a_macro_that_computes_it() -> None:
    wrong = (
        '<inertial>\n      <mass value="${2 * 0.1}"/>\n'
        '      <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>\n    </inertial>'
    )
    text = robot(link("wheel", '<cylinder radius="${0.1 / 2}" length="0.02"/>', wrong, TURNED))
    right = '<xacro:cylinder_inertia m="${2 * 0.1}" r="${0.1 / 2}" h="0.02" rpy="${pi/2} 0 0"/>'
    assert all_fixed(text) == text.replace(wrong, right)
    assert check(all_fixed(text)) == ()


@settings(max_examples=40)
@given(lengths, lengths, lengths, masses)
def test_without_a_macro_the_tensor_is_written_in_numbers(x: float, y: float, z: float, mass: float) -> None:
    before = MACROS[: MACROS.index("  <xacro:macro")]
    wrong = (
        f'<inertial><mass value="{mass}"/>'
        '<inertia ixx="9" ixy="0" ixz="0" iyy="9" iyz="0" izz="9"/></inertial>'
    )
    text = robot(link("plate", f'<box size="{x} {y} {z}"/>', wrong), before=before)
    done = all_fixed(text)
    assert check(done) == ()
    assert moments(done, "plate") == pytest.approx(box(mass, x, y, z), rel=1e-5)


def test_the_body_of_a_macro_is_not_edited_for_one_of_its_calls() -> None:
    """A macro makes the wheels. Only one of its calls has a radius that differs from that of the inertia."""
    wheel = (
        '  <xacro:macro name="wheel" params="name radius">\n'
        + link(
            "${name}",
            '<cylinder radius="${radius}" length="0.02"/>',
            '<xacro:cylinder_inertia m="1" r="0.05" h="0.02" rpy="${pi/2} 0 0"/>',
            TURNED,
        )
        + "  </xacro:macro>\n"
    )
    calls = '  <xacro:wheel name="left" radius="0.05"/>\n  <xacro:wheel name="right" radius="0.005"/>\n'
    text = robot(wheel, calls)
    (found,) = check(text)
    assert found.code == "I108"
    assert found.origin is not None
    assert "right" in found.origin.span.text
    assert found.fix is None
    assert all_fixed(text) == text


@pytest.mark.parametrize("order", list(itertools.permutations("abc")))
def test_inertia_macros_are_recognised_by_what_they_compute(order: tuple[str, ...]) -> None:
    macro = f"""  <xacro:macro name="solid" params="{" ".join(order)} turn:='0 0 0'">
    <inertial>
      <origin xyz="0 0 0" rpy="${{turn}}"/>
      <mass value="${{a}}"/>
      <inertia ixx="${{a*(3*b**2+c**2)/12}}" ixy="0" ixz="0" iyy="${{a/4*b**2+a/12*c**2}}" iyz="0"
               izz="${{a/2*b*b}}"/>
    </inertial>
  </xacro:macro>
"""
    macros = {m.name: m for m in find_macros(expand_text(MACROS + macro + "</robot>", "r.xacro").macros)}
    known = macros["solid"]
    assert (known.kind, known.mass, known.sizes, known.rpy) == ("cylinder", "a", ("b", "c"), "turn")
    assert (macros["box_inertia"].kind, macros["box_inertia"].sizes) == ("box", ("w", "d", "h"))
    assert (macros["rod_inertial"].sizes, macros["rod_inertial"].block) == (("radius", "length"), "origin")


def test_a_macro_with_a_wrong_formula_is_not_an_inertia_macro() -> None:
    text = MACROS.replace("${m*r*r/2}", "${m*r*r}") + "</robot>"
    names = {m.name for m in find_macros(expand_text(text, "r.xacro").macros)}
    assert names == {"box_inertia", "rod_inertial"}


def test_a_macro_without_rpy_is_edited_if_every_call_needs_the_rotation() -> None:
    macro = MACROS.replace(" rpy:='0 0 0'", "").replace('      <origin xyz="0 0 0" rpy="${rpy}"/>\n', "")
    call = '<xacro:cylinder_inertia m="1" r="0.05" h="0.02"/>'
    cylinder = '<cylinder radius="0.05" length="0.02"/>'
    text = robot(link("a", cylinder, call, TURNED), link("b", cylinder, call, TURNED), before=macro)
    done = all_fixed(text)
    assert check(done) == ()
    assert done.count('<origin xyz="0 0 0" rpy="1.570796327 0 0"/>') == 1
    upright = link("c", cylinder, call)
    one_sound = text.replace("</robot>", upright + "</robot>")
    assert all_fixed(one_sound) == one_sound
