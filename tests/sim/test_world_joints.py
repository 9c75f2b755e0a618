"""Bodies of a world with joints move as theory predicts."""

from math import pi, sin, sqrt

import numpy as np
import pytest

from kbot.sim import Simulation
from kbot.world import load_world

GRAVITY = 9.81


def link(name, pose="0 0 0 0 0 0", mass=1.0, moment=1e-6, inner=""):
    inertia = "".join(f"<i{a}{a}>{moment}</i{a}{a}>" for a in "xyz")
    return (
        f"<link name='{name}'><pose>{pose}</pose><inertial><mass>{mass}</mass>"
        f"<inertia>{inertia}</inertia></inertial>{inner}</link>"
    )


def joint(kind, parent, child, inner, name="j"):
    ends = f"<parent>{parent}</parent><child>{child}</child>"
    return f"<joint name='{name}' type='{kind}'>{ends}{inner}</joint>"


@pytest.fixture
def sim(tmp_path, kbot_robot):
    def build(inner: str, gravity: str = "0 0 -9.81") -> Simulation:
        file = tmp_path / "test.world"
        file.write_text(
            f"<sdf version='1.7'><world name='w'><gravity>{gravity}</gravity>"
            "<include><uri>model://ground_plane</uri></include>"
            f"<model name='m'><pose>3 0 2 0 0 0</pose>{inner}</model></world></sdf>"
        )
        return Simulation(kbot_robot, load_world(file))

    return build


def test_pendulum_swings_with_its_period(sim):
    """T = 2 pi sqrt(l / g) (1 + a^2/16) for a swing of 0.1 rad."""
    length, swing = 0.5, 0.1
    x, z = length * sin(swing), -length * (1 - swing**2 / 2 + swing**4 / 24)
    world = link("bob", f"{x} 0 {z} 0 0 0") + joint(
        "revolute", "world", "bob", f"<pose>{-x} 0 {-z} 0 0 0</pose><axis><xyz>0 1 0</xyz></axis>"
    )
    run = sim(world)
    period = 2 * pi * sqrt(length / GRAVITY) * (1 + swing**2 / 16)
    run.run(10 * period)
    bob = run.models.body_poses()["m"].translation
    assert bob[0] - 3.0 == pytest.approx(x, abs=0.01 * x)


def test_slide_falls_to_its_limit_and_stays(sim):
    world = link("block") + joint(
        "prismatic", "world", "block",
        "<axis><xyz>0 0 1</xyz><limit><lower>-0.4</lower><upper>0</upper></limit></axis>",
    )  # fmt: skip
    run = sim(world)
    run.run(0.2)
    assert run.models.body_poses()["m"].translation[2] == pytest.approx(2 - GRAVITY * 0.2**2 / 2, abs=0.003)
    run.run(3.0)
    assert run.models.body_poses()["m"].translation[2] == pytest.approx(1.6, abs=0.002)


def test_damped_slide_reaches_its_terminal_speed(sim):
    """The terminal speed is m g / d = 1 * 9.81 / 20 m/s."""
    inner = "<axis><xyz>0 0 1</xyz><dynamics><damping>20</damping></dynamics></axis>"
    run = sim(link("block") + joint("prismatic", "world", "block", inner))
    run.run(1.0)
    before = run.models.body_poses()["m"].translation[2]
    run.run(1.0)
    assert before - run.models.body_poses()["m"].translation[2] == pytest.approx(GRAVITY / 20, rel=1e-3)


def test_friction_holds_a_smaller_weight(sim):
    inner = "<axis><xyz>0 0 1</xyz><dynamics><friction>{}</friction></dynamics></axis>"
    held = sim(link("block") + joint("prismatic", "world", "block", inner.format(11)))
    held.run(1.0)
    assert held.models.body_poses()["m"].translation[2] == pytest.approx(2, abs=1e-3)
    falls = sim(link("block") + joint("prismatic", "world", "block", inner.format(5)))
    falls.run(0.5)
    assert falls.models.body_poses()["m"].translation[2] == pytest.approx(2 - (GRAVITY - 5) / 8, abs=0.01)


def test_spring_stretches_by_weight_over_stiffness(sim):
    inner = (
        "<axis><xyz>0 0 1</xyz><dynamics><damping>20</damping><spring_stiffness>100</spring_stiffness>"
        "<spring_reference>0.1</spring_reference></dynamics></axis>"
    )
    run = sim(link("block") + joint("prismatic", "world", "block", inner))
    run.run(10.0)
    assert run.models.body_poses()["m"].translation[2] == pytest.approx(2 + 0.1 - GRAVITY / 100, abs=2e-4)


def test_ball_joint_swings_in_both_directions(sim):
    """A spherical pendulum that is released at (a, a) is at (-a, -a) after half a period."""
    offset, length = 0.03, 0.5
    world = link("bob", f"{offset} {offset} {-length} 0 0 0") + joint(
        "ball", "world", "bob", f"<pose>{-offset} {-offset} {length} 0 0 0</pose>"
    )
    run = sim(world)
    run.run(pi * sqrt(length / GRAVITY))
    where = run.models.body_poses()["m"].translation - (3, 0, 2)
    assert where[:2] == pytest.approx((-offset, -offset), abs=1e-3)


def test_screw_descends_as_it_turns(sim):
    """The torque m g lead accelerates I + m lead^2, so that a = g m lead^2 / (I + m lead^2)."""
    lead, moment = 0.05, 0.01
    inner = f"<axis><xyz>0 0 1</xyz></axis><screw_thread_pitch>{2 * pi * lead}</screw_thread_pitch>"
    run = sim(link("nut", moment=moment) + joint("screw", "world", "nut", inner))
    run.run(0.5)
    pose = run.models.body_poses()["m"]
    fallen = pose.translation[2] - 2
    assert fallen == pytest.approx(-GRAVITY * lead**2 / (moment + lead**2) * 0.5**2 / 2, rel=0.02)
    turn = np.unwrap([0.0, pose.yaw])[1]
    assert (fallen / lead - turn) % (2 * pi) == pytest.approx(0.0, abs=0.02) or (fallen / lead - turn) % (
        2 * pi
    ) == pytest.approx(2 * pi, abs=0.02)


def test_four_bar_linkage_keeps_its_coupler_level(sim):
    """Two equal cranks of a parallelogram, released off the vertical, carry a bar that stays level."""
    turn = "<axis><xyz>0 1 0</xyz></axis>"
    world = (
        link("left", "0.1 0 -0.3 0 0 0") + link("right", "0.6 0 -0.3 0 0 0")
        + link("bar", "0.35 0 -0.3 0 0 0", moment=0.02)
        + joint("revolute", "world", "left", f"<pose>-0.1 0 0.3 0 0 0</pose>{turn}", "a")
        + joint("revolute", "world", "right", f"<pose>-0.1 0 0.3 0 0 0</pose>{turn}", "b")
        + joint("revolute", "left", "bar", f"<pose>-0.25 0 0 0 0 0</pose>{turn}", "c")
        + joint("revolute", "right", "bar", f"<pose>0.25 0 0 0 0 0</pose>{turn}", "d")
    )  # fmt: skip
    run = sim(world)
    lowest = 2.0
    for _ in range(50):
        run.run(0.02)
        bar = run.models.body_poses()["m::bar"]
        assert bar.rpy == pytest.approx((0, 0, 0), abs=2e-3)
        lowest = min(lowest, float(bar.translation[2]))
    assert lowest == pytest.approx(2 - sqrt(0.1**2 + 0.3**2), abs=2e-3)


def test_links_of_one_model_collide_only_with_self_collide(sim):
    box = "<collision name='c'><geometry><box><size>0.2 0.2 0.2</size></box></geometry></collision>"
    world = (
        link("shelf", inner=box) + link("block", "0 0 0.3 0 0 0", moment=0.01, inner=box)
        + joint("fixed", "world", "shelf", "", "f")
    )  # fmt: skip
    through = sim(world)
    through.run(2.0)
    assert through.models.body_poses()["m::block"].translation[2] < 0.2
    stopped = sim("<self_collide>true</self_collide>" + world)
    stopped.run(2.0)
    assert stopped.models.body_poses()["m::block"].translation[2] == pytest.approx(2.2, abs=2e-3)


def test_link_without_gravity_does_not_fall(sim):
    run = sim(link("block", inner="<gravity>false</gravity>"))
    run.run(1.0)
    assert run.models.body_poses()["m"].translation[2] == pytest.approx(2.0, abs=1e-9)


def test_state_with_joints_is_restored_bit_for_bit(sim):
    run = sim(link("bob", "0.3 0 0 0 0 0") + joint("ball", "world", "bob", "<pose>-0.3 0 0 0 0 0</pose>"))
    run.run(0.4)
    saved = run.state()
    run.run(0.4)
    once = run.state_sha256()
    run.restore(saved)
    run.run(0.4)
    assert run.state_sha256() == once


def test_movable_plane_is_ignored_with_a_warning_at_its_line(sim):
    """The engine allows planes only on static bodies."""
    shape = "<collision name='c'><geometry><plane/></geometry></collision>"
    found = sim(f"<link name='l'>\n{shape}</link>")
    (warning,) = [d for d in found.diagnostics if d.code == "W106"]
    assert "'m': this collision shape is ignored: a plane or a height field cannot move" in warning.message
    assert warning.origin.span.line == 2
    found.run(0.1)


def test_shapes_that_are_ignored_for_one_reason_are_one_warning(sim):
    shape = "<collision name='c'><geometry><plane/></geometry></collision>"
    found = sim("\n".join(f"<link name='l{n}'>{shape}</link>" for n in range(3)))
    (warning,) = [d for d in found.diagnostics if d.code == "W106"]
    assert warning.message.endswith("make its model static (3 places)")
    assert [warning.origin.span.line, *(r.origin.span.line for r in warning.related)] == [1, 2, 3]


def test_engine_warnings_are_reported_at_the_model(sim):
    """The engine cannot distinguish two rotations about the same axis."""
    axes = "<axis><xyz>0 0 1</xyz></axis><axis2><xyz>0 0 1</xyz></axis2>"
    run = sim(link("bob") + joint("universal", "world", "bob", axes))
    (finding,) = [d for d in run.diagnostics if d.code == "W110"]
    assert not finding.is_error
    assert finding.message.startswith(
        "'m': the physics engine warns: Inertia matrix is too close to singular"
    )
    assert "Time" not in finding.message
    assert finding.origin is not None


def test_links_collide_only_with_other_models_for_any_number_of_models(tmp_path, kbot_robot):
    """Pairs of models, 1 m apart. The two balls of a model overlap, and overlap its partner's by 1 cm."""
    ball = "<collision name='c'><geometry><sphere><radius>0.1</radius></sphere></geometry></collision>"
    two = "".join(link(f"l{z}", f"0 0 {z} 0 0 0", moment=0.004, inner=ball) for z in (0, 0.1))
    pairs = 16  # the engine has bits for 27 models
    models = "".join(
        f"<model name='m{2 * pair + side}'><pose>{3 + pair} {0.19 * side} 2 0 0 0</pose>{two}</model>"
        for pair in range(pairs)
        for side in (0, 1)
    )
    file = tmp_path / "test.world"
    file.write_text(f"<sdf version='1.7'><world name='w'><gravity>0 0 0</gravity>{models}</world></sdf>")
    run = Simulation(kbot_robot, load_world(file))
    run.run(0.2)
    poses = {name: pose.translation for name, pose in run.models.body_poses().items()}
    for pair in range(pairs):
        left, right = f"m{2 * pair}", f"m{2 * pair + 1}"
        assert poses[right][1] - poses[left][1] > 0.195
        for model in (left, right):
            assert poses[f"{model}::l0.1"] - poses[model] == pytest.approx((0.0, 0.0, 0.1), abs=1e-9)
