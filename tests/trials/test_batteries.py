"""Batteries: a healthy robot of any kind and size passes, and a robot with a fault of a tenth does not."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import kbot
from kbot.model import RobotModel
from kbot.model.load import load_robot, load_robot_text
from kbot.text import KbotError
from kbot.trials import Command, Scenario, TrialResult, run_trial
from kbot.trials.batteries import (
    BATTERIES,
    NotApplicable,
    all_batteries,
    battery,
    cruising_speed,
    not_applicable,
    turning_speed,
)
from kbot.trials.commanded_motion import CommandedMotion
from kbot.trials.robot_facts import DriveKind, robot_facts
from kbot.trials.trace import Trace

PACKAGE = Path(kbot.__file__).parent / "robots" / "kbot_description"
COMMANDED = tuple(name for name in BATTERIES if name not in ("rooms", "maze"))
"""The batteries without navigation, which are quick for robots of any size."""


def shipped(**arguments: float) -> RobotModel:
    return load_robot("kbot", {name: str(value) for name, value in arguments.items()}).require()


def scaled(factor: float) -> RobotModel:
    """KBot in another size. Its mass grows with the third power."""
    sizes = {
        "base_width": 0.16,
        "base_len": 0.16,
        "base_height": 0.01,
        "wheel_radius": 0.035,
        "wheel_width": 0.005,
        "base_wheel_gap": 0.007,
        "wheel_joint_offset": 0.02,
    }
    return shipped(**{name: factor * size for name, size in sizes.items()}, max_speed=min(factor, 3.0))


def edited(folder: Path, *edits: tuple[str, str]) -> RobotModel:
    """KBot with texts of its xacro files replaced."""
    package = folder / "kbot_description"
    shutil.copytree(PACKAGE, package)
    count = 0
    for file in (package / "urdf").glob("*.xacro"):
        text = file.read_text()
        for before, after in edits:
            count += text.count(before)
            text = text.replace(before, after)
        file.write_text(text)
    assert count >= len(edits)
    return load_robot(package / "urdf" / "kbot.xacro").require()


def tried(name: str, robot: RobotModel) -> TrialResult:
    scenario = battery(name, robot)
    return run_trial(scenario, scenario.seeds[0], robot)


@pytest.mark.parametrize("name", BATTERIES)
def test_the_shipped_robot_passes(name: str) -> None:
    result = tried(name, shipped())
    assert result.passed, result.reason


@pytest.mark.parametrize("factor", [0.3, 12.0])
@pytest.mark.parametrize("name", COMMANDED)
def test_a_robot_of_5_cm_and_one_of_2_m_pass(name: str, factor: float) -> None:
    result = tried(name, scaled(factor))
    assert result.passed, result.reason


FAULTS = {
    "the controller assumes wheels a tenth too large": (
        "straight",
        ("<wheelDiameter>${2*wheel_radius}", "<wheelDiameter>${2.2*wheel_radius}"),
    ),
    "the controller assumes wheels a tenth too small": (
        "straight",
        ("<wheelDiameter>${2*wheel_radius}", "<wheelDiameter>${1.8*wheel_radius}"),
    ),
    "the left wheel is a tenth larger": (
        "narrow_gate",
        (
            '<cylinder radius="${wheel_radius}"',
            "<cylinder radius=\"${wheel_radius*(1.1 if prefix == 'left' else 1.0)}\"",
        ),
    ),
    "the controller assumes a separation a tenth too wide": (
        "circle",
        ("<wheelSeparation>${wheel_separation}", "<wheelSeparation>${1.1*wheel_separation}"),
    ),
    "the controller assumes a separation a tenth too narrow": (
        "square",
        ("<wheelSeparation>${wheel_separation}", "<wheelSeparation>${0.9*wheel_separation}"),
    ),
    "the caster is a tenth too low": (
        "standing_still",
        ("${-(caster_wheel_radius + base_height/2)}", "${-(1.1*caster_wheel_radius + base_height/2)}"),
    ),
    "the caster is a tenth too high": (
        "standing_still",
        ("${-(caster_wheel_radius + base_height/2)}", "${-(0.9*caster_wheel_radius + base_height/2)}"),
    ),
    "the motors are too weak": ("slope", ("${9.81*wheel_radius", "${0.981*wheel_radius")),
    "the tyres are worn": ("slope", ("<mu1>1.0</mu1>", "<mu1>0.3</mu1>")),
    "the tyres are on ice": ("push", ("<mu1>1.0</mu1>", "<mu1>0.05</mu1>")),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_fails(tmp_path: Path, fault: str) -> None:
    name, edit = FAULTS[fault]
    result = tried(name, edited(tmp_path, edit))
    assert not result.error
    assert not result.passed


FORWARD, TURN, LATERAL = "forward", "turn", "lateral"
EXCHANGED = (
    ("<leftJoint>left_wheel_joint", "<leftJoint>right_wheel_joint"),
    ("<rightJoint>right_wheel_joint", "<rightJoint>left_wheel_joint"),
)
MIRRORED = (
    ('prefix="left" reflect="1"', 'prefix="left" reflect="-1"'),
    ('prefix="right" reflect="-1"', 'prefix="right" reflect="1"'),
)
FLIPPED = (('<axis xyz="0 1 0"', '<axis xyz="0 -1 0"'),)
WRONG_WAY: dict[str, tuple[tuple[tuple[str, str], ...], set[str]]] = {
    # each wheel gets the speed of the other: w = (right - left) / b has the other sign
    "its wheels are exchanged in the plugin": (EXCHANGED, {TURN}),
    "its wheels are mounted on the other sides": (MIRRORED, {TURN}),
    # both speeds have the other sign, and with them their sum and their difference
    "its axes point to the right": (FLIPPED, {FORWARD, TURN}),
    # turned by 180 degrees: the difference has the other sign twice
    "its front is at the back": ((*FLIPPED, *EXCHANGED), {FORWARD}),
}
"""Edits of KBot, and the motions that then have the wrong direction."""


def commanded_motions(name: str, kind: DriveKind) -> set[str]:
    """What a battery commands of a base without declared limits, by its docstring."""
    if name in ("push", "standing_still"):
        return set()
    if name in ("straight", "slope", "step", "narrow_gate"):
        return {FORWARD}
    can_turn = kind is not DriveKind.STEERED if name == "emergency_stop" else True
    slips = kind in (DriveKind.SKID_STEERED, DriveKind.TRACKED)
    turns = can_turn and not (slips and name in ("emergency_stop", "payload"))
    is_lateral = kind is DriveKind.HOLONOMIC and name in ("square", "emergency_stop")
    return {FORWARD, *([TURN] if turns else []), *([LATERAL] if is_lateral else [])}


@pytest.mark.parametrize("name", BATTERIES)
@pytest.mark.parametrize("fault", WRONG_WAY)
def test_a_robot_that_moves_the_wrong_way_fails_each_battery_with_that_motion(
    tmp_path: Path, fault: str, name: str
) -> None:
    edits, wrong = WRONG_WAY[fault]
    robot = edited(tmp_path, *edits)
    if name in ("rooms", "maze"):
        with pytest.raises(NotApplicable, match=r"turns are reversed|drives backwards"):
            battery(name, robot)
        return
    is_wrong = bool(commanded_motions(name, DriveKind.DIFFERENTIAL) & wrong)
    result = tried(name, robot)
    assert not result.error
    assert result.passed is not is_wrong, result.reason


def test_the_facts_of_the_shipped_robot() -> None:
    facts = robot_facts(shipped())
    assert facts.kind is DriveKind.DIFFERENTIAL
    # 0.16 m of plate, 7 mm of gap and half a wheel of 5 mm on each side
    assert facts.size == pytest.approx(0.16 + 2 * 0.007 + 0.005)
    # the rear corner of the plate, from the middle of the axle
    assert facts.reach == pytest.approx(math.hypot(0.02 + 0.08, 0.08))
    assert facts.top_speeds == pytest.approx((1.0, 1.0, 1.0 / 0.087))
    # the caster is 0.06 m behind the middle of the plate, the axle 0.02 m before it
    share = 1.0 + facts.centre_of_mass[0] / 0.08
    assert facts.traction_slope == pytest.approx(share / (1.0 + facts.centre_height / 0.08))
    # the slowest of V / 2, sqrt(a L) and sqrt(g r)
    assert cruising_speed(facts) == pytest.approx(math.sqrt(1.0 * 0.179))
    assert turning_speed(facts) == pytest.approx(math.sqrt(math.pi / 4.0 * 8.0))


def test_commands_lead_where_closed_forms_do() -> None:
    motion = CommandedMotion(robot_facts(shipped()))
    motion.drive(0.2, 0.0, 4.0)
    motion.stop()
    # the deceleration takes as long as the acceleration, so the way is speed times time
    assert motion.pose.x == pytest.approx(0.8)
    assert motion.settling == pytest.approx(0.2, abs=0.021)
    motion.drive(0.0, 1.0, 1.0)
    motion.stop()
    assert motion.pose.yaw == pytest.approx(1.0)
    assert motion.path_length == pytest.approx(0.8)


CASTER = (
    '<joint name="{0}_joint" type="fixed"><parent link="base_link"/><child link="{0}"/>'
    '<origin xyz="{1} 0 0.03"/></joint><link name="{0}"><inertial><mass value="0.2"/>'
    '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>'
    '<collision><geometry><sphere radius="0.03"/></geometry></collision></link>'
)


def wheel(name: str, x: float, y: float, parent: str = "base_link", z: float = 0.1) -> str:
    return (
        f'<joint name="{name}_joint" type="continuous"><parent link="{parent}"/><child link="{name}"/>'
        f'<origin xyz="{x} {y} {z}"/><axis xyz="0 1 0"/></joint><link name="{name}"><inertial>'
        '<mass value="0.5"/><inertia ixx="2e-3" iyy="2e-3" izz="2e-3" ixy="0" ixz="0" iyz="0"/></inertial>'
        f'<collision><origin rpy="{math.pi / 2} 0 0"/><geometry><cylinder radius="0.1" length="0.04"/>'
        "</geometry></collision></link>"
    )


def steered_wheel(name: str, x: float, y: float) -> str:
    return (
        f'<joint name="{name}_steering" type="revolute"><parent link="base_link"/><child link="{name}_fork"/>'
        f'<origin xyz="{x} {y} 0.1"/><axis xyz="0 0 1"/>'
        '<limit lower="-0.6" upper="0.6" effort="50" velocity="5"/></joint>'
        f'<link name="{name}_fork"><inertial><mass value="0.2"/>'
        '<inertia ixx="2e-3" iyy="2e-3" izz="2e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    ) + wheel(name, 0.0, 0.0, f"{name}_fork", 0.0)


def base(parts: str, x: float = 0.0) -> RobotModel:
    return load_robot_text(
        f'<robot name="base"><link name="base_link"><inertial><origin xyz="{x} 0 0.1"/><mass value="10"/>'
        '<inertia ixx="0.2" iyy="0.4" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial><collision>'
        f'<origin xyz="{x} 0 0.15"/><geometry><box size="0.5 0.3 0.1"/></geometry></collision></link>'
        f"{parts}</robot>",
        "base.urdf",
    ).require()


CORNERS = {"front_left": (1, 1), "front_right": (1, -1), "back_left": (-1, 1), "back_right": (-1, -1)}
FOUR = "".join(wheel(name, 0.2 * x, 0.2 * y) for name, (x, y) in CORNERS.items())
CAR = (
    wheel("left", 0.0, 0.2)
    + wheel("right", 0.0, -0.2)
    + steered_wheel("front_left", 0.5, 0.2)
    + steered_wheel("front_right", 0.5, -0.2)
)
MECANUM = (
    '<gazebo><plugin filename="gz-sim-mecanum-drive-system" name="gz::sim::systems::MecanumDrive">'
    + "".join(f"<{name}_joint>{name}_joint</{name}_joint>" for name in CORNERS)
    + "<wheel_separation>0.4</wheel_separation><wheelbase>0.4</wheelbase><wheel_radius>0.1</wheel_radius>"
    "</plugin></gazebo>"
)
TRACKS = "".join(
    f'<joint name="{side}_joint" type="fixed"><parent link="base_link"/><child link="{side}"/>'
    f'<origin xyz="0 {y} 0.05"/></joint><link name="{side}"><inertial><mass value="2"/>'
    '<inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial>'
    '<collision><geometry><box size="0.5 0.08 0.1"/></geometry></collision></link>'
    f'<gazebo><plugin filename="gz-sim-track-controller-system" name="gz::sim::systems::TrackController">'
    f"<link>{side}</link></plugin></gazebo>"
    for side, y in (("left", 0.2), ("right", -0.2))
) + (
    '<gazebo><plugin filename="gz-sim-tracked-vehicle-system" name="gz::sim::systems::TrackedVehicle">'
    "<left_track><link>left</link></left_track><right_track><link>right</link></right_track>"
    "<tracks_separation>0.4</tracks_separation></plugin></gazebo>"
)
KINDS = {
    DriveKind.DIFFERENTIAL: lambda: base(
        wheel("left", 0.0, 0.2) + wheel("right", 0.0, -0.2) + CASTER.format("caster", -0.2), -0.05
    ),
    DriveKind.SKID_STEERED: lambda: base(FOUR),
    DriveKind.STEERED: lambda: base(CAR, 0.25),
    DriveKind.HOLONOMIC: lambda: base(FOUR + MECANUM),
    DriveKind.TRACKED: lambda: base(TRACKS),
}


@cache
def run_of_kind(kind: DriveKind, name: str) -> tuple[Scenario, TrialResult]:
    robot = KINDS[kind]()
    scenario = battery(name, robot)
    return scenario, run_trial(scenario, scenario.seeds[0], robot, with_trace=True)


@pytest.mark.parametrize("name", COMMANDED)
@pytest.mark.parametrize("kind", KINDS)
def test_a_base_of_each_kind_passes(kind: DriveKind, name: str) -> None:
    robot = KINDS[kind]()
    assert robot_facts(robot).kind is kind
    if kind is DriveKind.TRACKED and name == "step":
        with pytest.raises(NotApplicable, match="are boxes"):
            battery(name, robot)
        return
    _, result = run_of_kind(kind, name)
    assert result.passed, result.reason


# signs of x, y and the heading, relative to the start, of a robot whose motions have the wrong direction
SYMMETRIES = {
    "mirrored": ((1.0, -1.0, -1.0), {TURN, LATERAL}),
    "reversed": ((-1.0, -1.0, 1.0), {FORWARD, LATERAL}),
    "mirrored and reversed": ((-1.0, 1.0, -1.0), {FORWARD, TURN}),
}


def moved_otherwise(trace: Trace, x: float, y: float, turn: float) -> Trace:
    """The true motion with other signs. Odometry and commands are kept: wheels that are exchanged or turn
    backwards do not change what a controller computes."""
    signs = {"x": x, "forward": x, "y": y, "left": y, "yaw": turn, "turn": turn, "turn_rate": turn}
    columns = dict(trace.columns)
    for name, sign in signs.items():
        start = 0.0 if name == "turn_rate" else trace[name][0]
        columns[name] = start + sign * (trace[name] - start)
    return replace(trace, columns=columns)


@pytest.mark.parametrize("name", COMMANDED)
@pytest.mark.parametrize("kind", KINDS)
def test_each_battery_notices_the_wrong_direction_of_what_it_commands(kind: DriveKind, name: str) -> None:
    """By symmetry, this is the motion of a robot of any kind with the fault: the worlds are symmetric about
    the line ahead, and level where a robot that drives backwards goes."""
    if kind is DriveKind.TRACKED and name == "step":
        return  # it does not apply
    scenario, result = run_of_kind(kind, name)
    trace = result.trace
    assert trace is not None
    for signs, wrong in SYMMETRIES.values():
        moved = moved_otherwise(trace, *signs)
        passed = all(result.passed for each in scenario.expect for result in each.results(moved))
        assert passed is not bool(commanded_motions(name, kind) & wrong), signs


def test_a_robot_that_turns_twice_as_far_fails_the_circle(tmp_path: Path) -> None:
    """It drives the circle of half the radius twice, and ends where it should with the right heading."""
    wide = ("<wheelSeparation>${wheel_separation}", "<wheelSeparation>${2*wheel_separation}")
    result = tried("circle", edited(tmp_path, wide))
    turn = next(measure for measure in result.measures if measure.name == "final_turn")
    assert turn.value == pytest.approx(4.0 * math.pi, rel=0.02)
    assert not result.passed


def test_a_car_drives_no_circle_that_it_cannot_steer_and_reports_batteries_that_do_not_apply() -> None:
    car = KINDS[DriveKind.STEERED]()
    facts = robot_facts(car)
    # the inner front wheel steers by 0.6 rad: the middle of the rear axle is half a track further out
    assert facts.smallest_radius == pytest.approx(0.5 / math.tan(0.6) + 0.2)
    command = battery("circle", car).steps[0].action
    assert isinstance(command, Command)
    assert command.linear / command.angular >= 1.2 * facts.smallest_radius * (1.0 - 1e-9)
    assert set(not_applicable(car)) == {"rooms", "maze"}
    assert "rooms" not in [scenario.name for scenario in all_batteries(car)]
    with pytest.raises(NotApplicable, match="'maze' does not apply: robot 'base' steers"):
        battery("maze", car)


def test_a_holonomic_base_drives_one_square_sideways() -> None:
    commands = [step.action for step in battery("square", KINDS[DriveKind.HOLONOMIC]()).steps]
    assert {math.copysign(1.0, c.lateral) for c in commands if isinstance(c, Command) and c.lateral} == {
        1.0,
        -1.0,
    }


def test_a_robot_that_cannot_drive_and_an_unknown_battery_are_refused() -> None:
    with pytest.raises(KbotError, match="robot 'base' cannot drive"):
        all_batteries(base(""))
    with pytest.raises(KbotError, match="did you mean 'straight'"):
        battery("straigth", shipped())


CORPUS = (
    "ROBOTIS-GIT+turtlebot3/turtlebot3_description/urdf/turtlebot3_burger.urdf",
    "yujinrobot+kobuki/kobuki_description/urdf/kobuki_standalone.urdf.xacro",
    "linorobot+linorobot2/linorobot2_description/urdf/robots/4wd.urdf.xacro",
    "linorobot+linorobot2/linorobot2_description/urdf/robots/mecanum.urdf.xacro",
    "Ekumen-OS+andino/andino_description/urdf/andino.urdf.xacro",
    "ros-mobile-robots+diffbot/diffbot_description/urdf/diffbot.urdf.xacro",
)


@pytest.mark.parametrize("name", ["standing_still", "straight", "circle", "slope", "step", "emergency_stop"])
@pytest.mark.parametrize("file", CORPUS)
def test_public_robots_pass(shared: Path, file: str, name: str) -> None:
    result = tried(name, load_robot(shared / "corpus" / "src" / file).require())
    assert result.passed, result.reason
