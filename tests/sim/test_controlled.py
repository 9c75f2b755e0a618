"""Controllers that are started, stopped, loaded and forgotten while a run goes on."""

import pytest

from kbot.messages import types as msg
from kbot.messages.control import Float64
from kbot.model.spawned import Setting, SpawnedController, with_controllers
from kbot.sim import Simulation
from kbot.text import KbotError

from .test_spawned import MANAGER, arm, transmission
from .test_spawned_drive import ROVER, WHEEL

FOLLOW = {"type": "position_controllers/JointTrajectoryController", "joints": ["shoulder", "elbow"]}
SHOULDER = {"type": "position_controllers/JointPositionController", "joint": "shoulder"}
ELBOW = {"type": "position_controllers/JointPositionController", "joint": "elbow"}
PUSH = {"type": "effort_controllers/JointEffortController", "joint": "elbow"}
STATES = {"type": "joint_state_controller/JointStateController", "publish_rate": 50}


@pytest.fixture
def build(urdf):
    def made(running: dict[str, dict], idle: dict[str, dict], elbow: str = "Position") -> Simulation:
        robot = urdf(arm(MANAGER + transmission("shoulder", "Position") + transmission("elbow", elbow)))
        spawned = [
            SpawnedController(
                f"/arm/{name}",
                {key: Setting(value, robot.origin) for key, value in values.items()},
                name in running,
                1,
                robot.origin,
            )
            for name, values in (running | idle).items()
        ]
        return Simulation(with_controllers(robot, spawned))

    return made


def tell(sim: Simulation, controller: str, value: float) -> None:
    sim.bus.publish(f"/arm/{controller}/command", Float64(value))


def test_one_that_is_stopped_obeys_no_more_and_its_joint_stays_where_it_was_told(build):
    sim = build({"shoulder": SHOULDER}, {})
    tell(sim, "shoulder", 0.4)
    sim.run(1.0)
    sim.switch_controllers([], ["/arm/shoulder"])
    with pytest.raises(KbotError, match="/arm/shoulder is loaded and not started"):
        tell(sim, "shoulder", -0.4)
    sim.run(1.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(0.4, abs=5e-3)
    sim.switch_controllers(["/arm/shoulder"], [])
    tell(sim, "shoulder", -0.4)
    sim.run(1.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(-0.4, abs=5e-3)


def test_a_joint_of_efforts_is_let_go(build):
    """Under 1 N m less than its weight's moment a bar falls either way; without force it hangs down."""
    sim = build({"shoulder": SHOULDER, "push": PUSH}, {}, "Effort")
    tell(sim, "push", -20.0)
    sim.run(0.3)
    turned = sim.joint_positions["elbow"]
    assert turned < -0.5
    sim.switch_controllers([], ["/arm/push"])
    sim.run(0.01)
    assert dict(zip(sim.joint_states.name, sim.joint_states.effort, strict=True))["elbow"] == 0.0


def test_one_is_switched_for_another_that_commands_the_same_joints(build):
    sim = build({"follow": FOLLOW}, {"shoulder": SHOULDER})
    with pytest.raises(KbotError, match="/arm/follow commands 'shoulder' too"):
        sim.switch_controllers(["/arm/shoulder"], [])
    sim.switch_controllers(["/arm/shoulder"], ["/arm/follow"])
    tell(sim, "shoulder", 0.3)
    sim.run(1.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(0.3, abs=5e-3)
    assert sim.joint_positions["elbow"] == pytest.approx(0.0, abs=5e-3)


@pytest.mark.parametrize(
    ("start", "stop", "words"),
    [
        (["/arm/shoulder"], [], "runs already"),
        ([], ["/arm/elbow"], "does not run"),
        ([], ["/arm/sholder"], "did you mean '/arm/shoulder'"),
        (["/arm/nobody"], [], "no controller /arm/nobody is loaded"),
        ([], ["/arm/states"], "tells joint states itself"),
    ],
)
def test_where_it_is_strict_all_is_left_as_it_was_and_else_what_can_be_is_done(build, start, stop, words):
    sim = build({"shoulder": SHOULDER, "states": STATES}, {"elbow": ELBOW})
    before = sim.named().stopped
    with pytest.raises(KbotError, match=words):
        sim.switch_controllers([*start], [*stop])
    assert sim.named().stopped == before
    sim.switch_controllers([*start, "/arm/elbow"], stop, strict=False)
    assert "/arm/elbow" not in sim.named().stopped


def test_one_is_loaded_started_stopped_and_forgotten(build):
    sim = build({}, {})
    sim.load_controller("/arm/late", SHOULDER)
    with pytest.raises(KbotError, match="loaded already"):
        sim.load_controller("/arm/late", SHOULDER)
    sim.switch_controllers(["/arm/late"], [])
    tell(sim, "late", 0.4)
    sim.run(1.0)
    assert sim.joint_positions["shoulder"] == pytest.approx(0.4, abs=5e-3)
    with pytest.raises(KbotError, match="runs: stop it first"):
        sim.unload_controller("/arm/late")
    sim.switch_controllers([], ["/arm/late"])
    sim.unload_controller("/arm/late")
    with pytest.raises(KbotError, match="is not loaded"):
        tell(sim, "late", 0.0)
    sim.load_controller("/arm/late", ELBOW)
    sim.switch_controllers(["/arm/late"], [])
    tell(sim, "late", 0.2)
    sim.run(1.0)
    assert sim.joint_positions["elbow"] == pytest.approx(0.2, abs=5e-3)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"type": "position_controllers/JointPositionContoller", "joint": "shoulder"}, "did you mean"),
        ({"type": "position_controllers/JointPositionController"}, "lacks joint"),
        ({"type": "position_controllers/JointPositionController", "joint": "sholder"}, "does not have"),
        ({"type": "effort_controllers/JointEffortController", "joint": "shoulder"}, "commands the effort"),
        ({}, "type ''"),
    ],
)
def test_what_would_not_be_loaded_is_said(build, parameters, words):
    sim = build({}, {})
    with pytest.raises(KbotError, match=words):
        sim.load_controller("/arm/late", parameters)
    assert sim.named().control.managed == ()


def test_one_whose_topic_carries_something_else_is_not_loaded_by_half(build):
    sim = build({"shoulder": SHOULDER}, {})
    noted, control = sim.noted, sim.named().control
    sim.bus.advertise("/arm/elbow/command", msg.Twist)
    with pytest.raises(KbotError, match="/arm/elbow/command carries Twist"):
        sim.load_controller("/arm/elbow", ELBOW)
    assert (sim.noted, sim.named().control) == (noted, control)
    with pytest.raises(KbotError, match="no controller /arm/elbow is loaded"):
        sim.switch_controllers(["/arm/elbow"], [])


def test_a_drive_that_is_stopped_brakes_and_heeds_nobody(drive):
    sim = drive
    sim.bus.publish("/cmd_vel", msg.Twist(msg.Vector3(0.3)))
    sim.run(0.4)
    assert sim.odometry.twist.x > 0.2
    sim.switch_controllers([], ["/base"])
    sim.run(1.0)
    with pytest.raises(KbotError, match="/base is loaded and not started"):
        sim.bus.publish("/cmd_vel", msg.Twist(msg.Vector3(0.3)))
    sim.cmd_vel(0.3, 0.0)
    sim.run(0.5)
    assert sim.odometry.twist.x == pytest.approx(0.0, abs=1e-3)
    sim.switch_controllers(["/base"], [])
    sim.cmd_vel(0.3, 0.0)
    sim.run(1.0)
    assert sim.odometry.twist.x == pytest.approx(0.3, abs=0.02)


@pytest.fixture
def drive(urdf) -> Simulation:
    """A base with a controller of ROS 1."""
    robot = urdf(ROVER.format(WHEEL.format("left", 0.2) + WHEEL.format("right", -0.2) + MANAGER))
    wanted = {"type": "diff_drive_controller/DiffDriveController"}
    wanted |= {"left_wheel": "left_joint", "right_wheel": "right_joint"}
    settings = {key: Setting(value, robot.origin) for key, value in wanted.items()}
    return Simulation(with_controllers(robot, [SpawnedController("/base", settings, True, 1, robot.origin)]))


def test_a_reset_a_state_and_a_changed_robot_keep_what_they_should(build):
    sim = build({"shoulder": SHOULDER}, {"elbow": ELBOW})
    start = sim.state()
    sim.switch_controllers(["/arm/elbow"], ["/arm/shoulder"])
    sim.load_controller("/arm/late", FOLLOW)
    changed = sim.with_robot(sim.robot)
    assert changed.named().stopped == {"/arm/shoulder", "/arm/late"}
    sim.restore(start)
    assert "/arm/elbow" in sim.named().stopped
    sim.switch_controllers(["/arm/elbow"], ["/arm/shoulder"])
    sim.reset()
    assert sim.named().stopped == {"/arm/elbow", "/arm/late"}


def test_what_was_switched_and_loaded_is_done_again_from_the_journal(build):
    from kbot.record.journal import do_again

    sim, again = build({"shoulder": SHOULDER}, {}), build({"shoulder": SHOULDER}, {})
    noted: list[tuple[int, str, dict]] = []
    sim.journal = lambda what, numbers: noted.append((sim.steps, what, numbers))
    tell(sim, "shoulder", 0.4)
    sim.run(0.3)
    sim.load_controller("/arm/late", FOLLOW)
    sim.switch_controllers(["/arm/late"], ["/arm/shoulder"])
    sim.follow_trajectory(["shoulder", "elbow"], [(0.5, [0.0, 0.5])])
    sim.run(0.5)
    sim.switch_controllers([], ["/arm/late"])
    sim.unload_controller("/arm/late")
    sim.run(0.2)
    for step, what, numbers in noted:
        again.step(step - again.steps)
        do_again(again, what, numbers)
    again.step(sim.steps - again.steps)
    assert again.state_sha256() == sim.state_sha256()
    assert again.named().unloaded == {"/arm/late"}
