"""Joints of SDF models. The expected values were derived by hand from the specification."""

from math import inf

import pytest

from kbot.world import load_world
from kbot.world.body_joints import JointMotion

BALL = "<collision name='c'><geometry><sphere><radius>0.1</radius></sphere></geometry></collision>"


@pytest.fixture
def world(tmp_path):
    def read(inner: str, version: str = "1.7"):
        file = tmp_path / "test.world"
        file.write_text(f"<sdf version='{version}'>\n<world name='w'>\n{inner}\n</world>\n</sdf>\n")
        return load_world(file)

    return read


def link(name: str, pose: str = "0 0 0 0 0 0") -> str:
    return f"<link name='{name}'><pose>{pose}</pose>{BALL}</link>"


def joint(kind: str, parent: str, child: str, inner: str = "", name: str = "j") -> str:
    ends = f"<parent>{parent}</parent><child>{child}</child>"
    return f"<joint name='{name}' type='{kind}'>{ends}{inner}</joint>"


def model(*inner: str) -> str:
    return "<model name='m'>" + "".join(inner) + "</model>"


def axis(xyz: str, inner: str = "", tag: str = "axis") -> str:
    return f"<{tag}><xyz>{xyz}</xyz>{inner}</{tag}>"


def test_hinge_has_its_anchor_axis_limits_and_dynamics(world):
    """The joint has its own pose in the child, and its axis is in the child's axes."""
    inner = "<pose>0.5 0 0 0 0 0</pose>" + axis(
        "0 2 0",
        "<limit><lower>-1</lower><upper>1e16</upper></limit>"
        "<dynamics><damping>0.1</damping><friction>0.2</friction>"
        "<spring_stiffness>3</spring_stiffness><spring_reference>0.4</spring_reference></dynamics>",
    )
    bodies = world(
        model(link("a"), link("b", "1 0 0 0 0 1.5707963"), joint("revolute", "a", "b", inner))
    ).bodies
    hung = bodies[1].joint
    assert (hung.parent, hung.anchor) == ("m", pytest.approx((0.5, 0, 0)))
    (freedom,) = hung.freedoms
    assert freedom.motion is JointMotion.TURN
    assert freedom.axis == pytest.approx((0, 1, 0))
    assert (freedom.lower, freedom.upper) == (-1, inf)
    assert (freedom.damping, freedom.friction) == (0.1, 0.2)
    assert (freedom.stiffness, freedom.spring_reference) == (3, 0.4)


@pytest.mark.parametrize(
    ("version", "inner", "expected"),
    [
        ("1.7", "<xyz expressed_in='__model__'>1 0 0</xyz>", (0, -1, 0)),
        ("1.7", "<xyz expressed_in='a'>0 1 0</xyz>", (1, 0, 0)),
        ("1.7", "<xyz>1 0 0</xyz>", (1, 0, 0)),
        ("1.4", "<xyz>1 0 0</xyz>", (0, -1, 0)),
        ("1.5", "<xyz>1 0 0</xyz>", (1, 0, 0)),
        ("1.6", "<xyz>1 0 0</xyz><use_parent_model_frame>1</use_parent_model_frame>", (0, -1, 0)),
    ],
)
def test_axis_is_in_the_frame_it_is_expressed_in(world, version, inner, expected):
    """The child is rotated by 90 degrees: the model's x is its -y. SDF 1.4 uses the model's axes."""
    text = model(link("a"), link("b", "1 0 0 0 0 1.5707963267948966"),
                 joint("revolute", "a", "b", f"<axis>{inner}</axis>"))  # fmt: skip
    hung = world(text, version).bodies[1].joint
    assert hung.freedoms[0].axis == pytest.approx(expected)


@pytest.mark.parametrize(
    ("kind", "motions"),
    [
        ("continuous", ["turn"]), ("prismatic", ["slide"]), ("ball", ["ball"]),
        ("universal", ["turn", "turn"]), ("revolute2", ["turn", "turn"]), ("screw", ["turn", "slide"]),
    ],
)  # fmt: skip
def test_every_joint_type_has_its_freedoms(world, kind, motions):
    inner = axis("1 0 0") + axis("0 1 0", tag="axis2")
    hung = world(model(link("a"), link("b"), joint(kind, "a", "b", inner))).bodies[1].joint
    assert [freedom.motion for freedom in hung.freedoms] == motions
    if kind == "universal":
        assert [freedom.axis for freedom in hung.freedoms] == [(1, 0, 0), (0, 1, 0)]


def test_link_fixed_to_the_world_is_static(world):
    text = model(link("a"), link("b"), joint("fixed", "world", "a", name="f"), joint("revolute", "a", "b"))
    first, second = world(text).bodies
    assert first.is_static
    assert not second.is_static
    assert second.joint.parent == "m"


def test_joints_can_connect_frames_and_links_of_nested_models(world):
    inner = "<model name='n'><pose>0 0 1 0 0 0</pose>" + link("x") + "</model>"
    text = model(
        link("a"), inner, "<frame name='f' attached_to='a'/>", joint("revolute", "f", "n::x", axis("0 0 1"))
    )
    bodies = {body.name: body for body in world(text).bodies}
    assert bodies["m::n"].joint.parent == "m"


def test_child_of_a_later_link_comes_after_it(world):
    """Each body comes after its parent."""
    text = model(
        link("tip"), link("base"), joint("revolute", "base", "tip"), joint("fixed", "world", "base", name="f")
    )
    names = [(body.name, body.joint.parent if body.joint else None) for body in world(text).bodies]
    assert names == [("m::base", None), ("m", "m::base")]


def test_closed_loop_of_joints_is_kept(world):
    """Of three hinges in a loop, two connect links to their parents, and the third connects two points."""
    text = model(
        link("a"), link("b"), link("c"),
        joint("revolute", "a", "b", axis("0 1 0"), "one"), joint("revolute", "b", "c", axis("0 1 0"), "two"),
        joint("revolute", "a", "c", axis("0 1 0"), "three"),
    )  # fmt: skip
    read = world(text)
    assert [body.joint.parent if body.joint else None for body in read.bodies] == [None, "m", "m::b"]
    (loop,) = read.loops
    assert (loop.first, loop.second) == ("m", "m::c")
    assert loop.points == (pytest.approx((0, -0.1, 0)), pytest.approx((0, 0.1, 0)))


def test_merged_include_becomes_part_of_the_model(world, tmp_path):
    (tmp_path / "part").mkdir()
    (tmp_path / "part" / "model.config").write_text("<model><sdf>model.sdf</sdf></model>")
    (tmp_path / "part" / "model.sdf").write_text(
        f"<sdf version='1.9'><model name='part'>{link('x', '0 1 0 0 0 0')}</model></sdf>"
    )
    include = "<include merge='true'><uri>model://part</uri><pose>1 0 0 0 0 0</pose></include>"
    text = model(link("a"), include, joint("fixed", "a", "x"))
    (body,) = world(text, "1.9").bodies
    assert sorted(tuple(part.pose.translation) for part in body.parts) == [(0, 0, 0), (1, 1, 0)]


@pytest.mark.parametrize(
    ("inner", "code", "message", "instead"),
    [
        (joint("revolute", "a", "c"), "W207", "has the unknown child link 'c'", "leaves the joint out"),
        (joint("revolute", "a", "a"), "W205", "connects a link to itself", "leaves the joint out"),
        (joint("hinge", "a", "b"), "W205", "has the unknown type 'hinge'", "fixes the joint"),
        (joint("revolute", "a", "b", axis("0 0 0")), "W204", "must not be 0 0 0", "uses the z axis"),
        (
            "<joint name='j' type='revolute'><child>b</child></joint>",
            "W205", "has no <parent>", "leaves the joint out",
        ),
        (
            joint("revolute", "a", "b", axis("0 0 1", "<limit><lower>1</lower><upper>0</upper></limit>")),
            "W204", "above its upper", "uses no limits",
        ),
    ],
)  # fmt: skip
def test_faults_of_joints_are_reported_at_their_line(world, inner, code, message, instead):
    found = world(f"<model name='m'>{link('a')}{link('b')}\n{inner}</model>")
    fault = next(d for d in found.diagnostics if d.code == code and message in d.message)
    assert (fault.is_error, fault.origin.span.line) == (False, 4)
    assert fault.hint.endswith(f"KBot {instead}")


def test_joint_between_two_frames_of_one_link_is_left_out(world):
    frame = "<frame name='f' attached_to='a'/>"
    found = world(f"<model name='m'>{link('a')}{frame}\n{joint('revolute', 'f', 'a', axis('0 0 1'))}</model>")
    (finding,) = found.diagnostics
    assert (finding.code, finding.is_error, finding.origin.span.line) == ("W205", False, 4)
    assert [body.joint for body in found.bodies] == [None]


@pytest.mark.parametrize(("kind", "tag"), [("revolute", "axis"), ("universal", "axis2")])
def test_missing_axis_is_reported(world, kind, tag):
    given = axis("0 0 1") if tag == "axis2" else ""
    (finding,) = world(
        f"<model name='m'>{link('a')}{link('b')}\n{joint(kind, 'a', 'b', given)}</model>"
    ).diagnostics
    assert (finding.code, finding.is_error, finding.origin.span.line) == ("W205", False, 4)
    assert f"joint 'j' has no <{tag}>" in finding.message
