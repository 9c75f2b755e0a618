"""How the objects of the Python interface appear in a prompt: `repr`, `dir` and tab completion."""

import enum
import inspect
import pkgutil
import re
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kbot
from kbot import (
    checks,
    kinematics,
    learn,
    messages,
    model,
    navigation,
    record,
    sensors,
    sim,
    text,
    trials,
    xacro,
)
from kbot import world as worlds
from kbot.brief import Brief
from kbot.sim.mujoco_export import MujocoModel
from kbot.templates import NewPackage, Sizes

PACKAGES = [
    "checks",
    "kinematics",
    "learn",
    "messages",
    "model",
    "navigation",
    "record",
    "ros",
    "sensors",
    "sim",
    "sweep",
    "templates",
    "text",
    "trials",
    "world",
    "xacro",
]
BROKEN = '<robot name="r"><link name="a"/><link name="b"/></robot>'
LONGEST = 450
"""Characters: an Odometry, whose numbers have 6 digits each."""
IN_OTHER_TESTS = {kbot.Node: "tests/client/test_node.py, which runs a KBot", kbot.ros.NodePilot: "as Node"}


def public_classes() -> set[type]:
    """The classes that the public names give, without errors and what has no instances of its own."""
    names = [(kbot, name) for name in kbot.__all__]
    names += [
        (getattr(kbot, package), name) for package in PACKAGES for name in getattr(kbot, package).__all__
    ]
    found = {value for where, name in names if inspect.isclass(value := getattr(where, name))}
    return {
        each
        for each in found
        if not issubclass(each, BaseException | enum.Enum)
        and not inspect.isabstract(each)
        and each is not navigation.Controller
    }


def still(trace: object) -> float:
    return 0.0


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> list[Any]:
    """An object of each public class."""
    folder = tmp_path_factory.mktemp("objects")
    broken = folder / "broken.xacro"
    broken.write_text(BROKEN)
    robot = kbot.load("kbot", lidar=True)
    simulation = kbot.Simulation(robot, world="boxes", seed=3)
    base = robot.links["base_link"]
    wheel = robot.joints["left_wheel_joint"]
    specs: list[sensors.Spec] = [
        sensors.Lidar(link="base_link", rate=20),
        sensors.Lidar(link="base_link", rows=4, name="cloud"),
        sensors.Imu(link="base_link"),
        sensors.Range(link="base_link"),
        sensors.Contact(link="base_link"),
        sensors.Line(link="base_link"),
        sensors.Gps(link="base_link"),
        sensors.GroundTruth(link="base_link"),
        sensors.Encoders(link="base_link"),
        sensors.ForceTorque(link="left_wheel", joint="left_wheel_joint"),
        sensors.Camera(link="base_link", width=64, height=48),
    ]
    mounted = []
    for spec in specs:
        with suppress(kbot.KbotError):  # the camera without OpenGL, the wheel that is driven
            mounted.append(simulation.add_sensor(spec))
    file = str(folder / "run.mcap")
    feed = record.Feed(simulation.bus, lambda: simulation.clock.nanoseconds)
    recorder = record.Recorder(simulation, feed, file)
    simulation.run(0.5)
    recorder.close()
    readings = [sensor.latest for sensor in mounted]
    recording = record.Recording(file)
    finding = checks.check_file(str(broken))[0]
    document = xacro.expand(broken, {})
    scenario = trials.Scenario(
        "straight",
        duration=1.0,
        robot=trials.RobotSource("kbot"),
        steps=[trials.Step(trials.Command(0.2))],
        expect=[trials.Bound("max_tilt", max=0.1)],
    )
    result = trials.run_trial(scenario, with_trace=True)
    assert result.trace is not None
    grid = worlds.world_grid(simulation.world)
    path = navigation.Path.through([(0.0, 0.0), (1.0, 0.0)])
    limits = navigation.ControllerLimits()
    goal = kbot.PlanarPose(0.5, 0.0, 0.0)
    goals = navigation.Goals(simulation)
    interface = learn.PolicyInterface("goal", (-0.5, 0.5), (-2.0, 2.0))
    policy = learn.Policy(lambda seen: seen, interface)
    outline = navigation.outline(robot, "base_link")
    origin = base.origin
    lidar = next(sensor for sensor in mounted if isinstance(sensor, sensors.LidarSensor))
    steered, holonomic = (
        object.__new__(kind) for kind in (kinematics.SteeredDrive, kinematics.HolonomicDrive)
    )
    for drive in (steered, holonomic):
        for name in kinematics.DifferentialDrive.__slots__:
            object.__setattr__(drive, name, getattr(robot.drive, name))
    return [
        *mounted,
        *readings,
        *specs,
        *(getattr(messages, name)() for name in messages.__all__ if _has_defaults(getattr(messages, name))),
        robot,
        robot.frames,
        robot.drive,
        steered,
        holonomic,
        robot.loaded,
        kinematics.NoDrive("it has no wheels"),
        base,
        wheel,
        base.inertial,
        base.visuals[0],
        base.collisions[0],
        wheel.pose,
        wheel.limit,
        base.visuals[0].material,
        wheel.dynamics or model.Dynamics(0.1, 0.0, origin),
        model.Mimic("left_wheel_joint", 1.0, 0.0, origin),
        model.SafetyController(0.0, 1.0, 1.0, 1.0, origin),
        model.Box((0.1, 0.2, 0.3), origin),
        model.Cylinder(0.1, 0.2, origin),
        model.Sphere(0.1, origin),
        model.Capsule(0.1, 0.2, origin),
        model.Mesh("package://kbot/base.stl", None, (1.0, 1.0, 1.0), origin),
        model.RobotModel(**{name: getattr(robot, name) for name in _fields(model.RobotModel)}),
        model.read_robot(document.require().document),
        robot.drive.wheels["left_wheel_joint"],
        robot.pose("left_wheel"),
        goal,
        kinematics.PlanarTwist(0.2, 0.0, 0.5),
        simulation,
        simulation.robots,
        simulation.robots.first,
        simulation.models,
        simulation.disturbances,
        simulation.draw,
        simulation.engine,
        simulation.journal,
        simulation.snapshots,
        simulation.stepping,
        simulation.commands,
        simulation.printed,
        simulation.bus,
        simulation.clock,
        simulation.odometry,
        simulation.state(),
        simulation.world,
        simulation.world.bodies[-1],
        simulation.world.bodies[-1].parts[0],
        sim.DriveLimits(),
        sim.BlockedJoint("left_wheel_joint"),
        sim.Slip("left_wheel", 0.1),
        sim.Payload("base_link", 1.0),
        sim.LostCommands(0.5),
        sim.SilentTopic("/scan"),
        sim.Kick((0.1, 0.0, 0.0)),
        worlds.Ellipsoid((0.1, 0.2, 0.3)),
        worlds.Plane((1.0, 1.0)),
        worlds.Box((0.1, 0.2, 0.3)),
        worlds.Cylinder(0.1, 0.2),
        worlds.Capsule(0.1, 0.2),
        worlds.Sphere(0.1),
        text.Origin(origin.span),
        worlds.HeightField(np.zeros((300, 300)), (3.0, 3.0)),
        worlds.TriangleMesh(np.zeros((500, 3)), np.zeros((300, 3), np.int32)),
        grid,
        simulation.bus.subscribe("/odom", messages.Odometry, print),
        simulation.bus.advertise("/a", messages.Odometry),
        simulation.clock.every(10.0, list),
        sensors.Noise(0.1),
        recorder,
        feed,
        recording,
        recording.summary(),
        next(recording.entries()),
        record.open_index(file),
        finding,
        checks.find_rule("D106"),
        checks.Finding(origin, "the wheels differ"),
        checks.Config(),
        checks.OpenFiles(),
        text.Fix("write 2", (text.Edit(origin.span, "2"),), True),
        text.Edit(origin.span, "2"),
        text.Related("the other wheel", origin),
        text.DiagnosticCollector(),
        origin,
        origin.span,
        origin.span.source,
        text.Call("macro", "wheel", origin.span),
        text.parse_xml(origin.span.source),
        *text.parse_xml(text.Source("a.xml", "<a>one<!-- two --></a>")).children,
        document,
        xacro.Limits(),
        xacro.Packages(),
        scenario,
        result,
        result.trace,
        result.measures[0],
        trials.RobotSource("kbot"),
        trials.Step(trials.Command()),
        trials.Range(0.0, 1.0),
        trials.Program("drive.py"),
        trials.Command(0.2),
        trials.Goal(1.0, 0.0),
        trials.Point(1.0, 0.0),
        trials.DriveWithPolicy("policy.onnx", trials.Point(1.0, 0.0)),
        trials.RunScript("drive.py"),
        trials.JointCommand({"arm": 1.0}),
        trials.Push((1.0, 0.0, 0.0), 0.1),
        trials.InjectFault(sim.BlockedJoint("arm")),
        trials.AddObject("box", 1.0, 0.0),
        trials.MoveObject("box", 1.0, 0.0),
        trials.RemoveObject("box"),
        trials.Bound("max_tilt", max=0.1),
        trials.Reaches(1.0, 0.0, within=0.1),
        trials.PassesThrough(1.0, 0.0, within=0.1),
        trials.NeverTouches(),
        trials.StaysUpright(),
        trials.Settles(within=1.0),
        trials.Check("still", still),
        trials.Measure("tilt", "rad", "The tilt.", still, 0.001),
        path,
        limits,
        goals,
        outline,
        navigation.GoToPose(goal),
        navigation.PurePursuit(path),
        navigation.RegulatedPurePursuit(path),
        navigation.ObstacleGuard(navigation.GoToPose(goal), outline),
        navigation.GridPlanner(grid, 0.1),
        navigation.LidarPoints(lidar),
        navigation.WithMap(simulation),
        navigation.WithoutMap(simulation),
        navigation.Navigator(None),
        navigation.NavigatorSettings(),
        navigation.LocalSettings(),
        navigation.SamplingSettings(),
        navigation.NavigationTopics(simulation, goals),
        navigation.Observation(0.0, goal, obstacles=np.zeros((90, 2))),
        navigation.NoPath(next(iter(navigation.Refusal)), "the goal is in a wall"),
        navigation.Pilot(simulation, navigation.GoToPose(goal)),
        navigation.GoalReport(goal, navigation.GoalState.REACHED),
        navigation.Trip(
            navigation.GoalReport(goal, navigation.GoalState.REACHED), 2.0, 0.5, 0.5, goal, 0.0, False, 1.0
        ),
        policy,
        interface,
        learn.PolicyController(policy, goal),
        learn.Sectors(8),
        learn.GoalTarget(1.0, 0.0),
        learn.PathTarget(path),
        NewPackage((Path("a"),) * 9, (), Path("urdf/a.xacro")),
        Sizes(),
        robot.to_mujoco(),
    ]


def _has_defaults(value: object) -> bool:
    if not (inspect.isclass(value) and hasattr(value, "__dataclass_fields__")):
        return False
    return all(p.default is not p.empty for p in inspect.signature(value).parameters.values())


def _fields(kind: type) -> list[str]:
    return list(inspect.signature(kind).parameters)


def test_the_table_has_every_public_class(objects: list[Any]) -> None:
    missing = public_classes() - {type(each) for each in objects} - IN_OTHER_TESTS.keys()
    assert missing <= {sensors.CameraSensor}, "without OpenGL there is no camera"


def test_a_repr_is_one_line_with_content(objects: list[Any]) -> None:
    for each in objects:
        shown = repr(each)
        assert "\n" not in shown, type(each)
        assert " object at 0x" not in shown, type(each)
        assert len(shown) <= LONGEST, shown


def test_dir_shows_no_private_names(objects: list[Any]) -> None:
    for each in objects:
        private = [name for name in dir(each) if name.startswith("_") and not name.startswith("__")]
        assert not private, type(each)


@pytest.mark.parametrize(
    ("kind", "shown"),
    [
        (kbot.Robot, r"Robot\('kbot', 6 links, 5 joints, '.*kbot\.xacro'\)"),
        (model.Link, r"Link\('base_link', 1\.024 kg, 1 visual, 1 collision\)"),
        (model.Joint, r"Joint\('left_wheel_joint', 'continuous', parent='base_link', child='left_wheel'\)"),
        (kinematics.DifferentialDrive, r"DifferentialDrive\(left=.*, radius=0\.035, separation=0\.174\)"),
        (kbot.Simulation, r"Simulation\('kbot', world='boxes', time=0\.5, seed=3\)"),
        (sensors.Lidar, r"Lidar\(link='base_link', rate=20\.?0?\)"),
        (sensors.LidarSensor, r"LidarSensor\('scan', link='base_link', rate=20, topic='/scan'\)"),
        (messages.LaserScan, r"LaserScan\(.*range_max=10, ranges=<360 float32>\)"),
        (kbot.World, r"World\('boxes', 13 bodies\)"),
        (worlds.OccupancyGrid, r"OccupancyGrid\(cells=<\d+x\d+ int8>, resolution=0\.0\d, origin=P.*\)"),
        (record.Recording, r"Recording\('.*run\.mcap', MCAP\)"),
        (record.Summary, r"Summary\(MCAP, \d+ topics, \d+ messages, 0\.5 s\)"),
        (text.Diagnostic, r"Diagnostic\('U008', 'error', \"link 'b' .*\", .*broken\.xacro:1:33\)"),
        (trials.TrialResult, r"TrialResult\('straight', seed=0, passed, 1 measure\)"),
        (trials.Trace, r"Trace\(\d+ samples, 1 s, \d+ quantities\)"),
        (MujocoModel, r"MujocoModel\(\d+ bodies, \d+ actuators, wheels=\['left_.*\]\)"),
    ],
    ids=lambda value: value.__name__ if inspect.isclass(value) else "",
)
def test_the_repr_names_the_object(objects: list[Any], kind: type, shown: str) -> None:
    first = next(each for each in objects if type(each) is kind)
    assert re.fullmatch(shown, repr(first)), repr(first)


def test_dir_of_a_simulation_is_what_a_user_may_use() -> None:
    names = dir(kbot.Simulation("kbot"))
    assert names == sorted(names)
    assert {"cmd_vel", "run", "odometry", "robot", "add_sensor", "reset", "plot"} <= set(names)
    assert not [name for name in names if name.startswith("_")]


def test_the_robot_of_a_simulation_is_that_of_load() -> None:
    """Also of one that was spawned, and of one that a program made itself."""
    robot = kbot.load("kbot")
    simulation = kbot.Simulation("kbot")
    assert simulation.robot.drive.radius == robot.drive.radius == 0.035
    assert simulation.robot.pose("left_wheel") == robot.pose("left_wheel")
    assert kbot.Simulation(robot).robot is robot
    plain = model.RobotModel(**{name: getattr(robot, name) for name in _fields(model.RobotModel)})
    assert kbot.Simulation(plain).robot.pose("left_wheel") == robot.pose("left_wheel")
    assert simulation.models.spawn_model("kbot", "b", x=1.0).robot.drive.radius == 0.035


def run_python(code: str) -> str:
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return ended.stdout.strip()


def test_every_public_package_works_after_import_kbot() -> None:
    code = "import kbot\n" + "\n".join(
        f"assert dir(kbot.{name}) == sorted(kbot.{name}.__all__)" for name in PACKAGES
    )
    assert (
        run_python(f"{code}\nprint(kbot.record.Recording.__name__, kbot.learn.Policy.__name__)")
        == "Recording Policy"
    )


def test_dir_of_a_package_lists_its_public_names() -> None:
    assert dir(kbot) == sorted(kbot.__all__)
    for name in PACKAGES:
        package = getattr(kbot, name)
        assert name in dir(kbot)
        assert dir(package) == sorted(package.__all__)
        for each in package.__all__:
            assert getattr(package, each) is not None


def test_every_package_is_public_or_internal() -> None:
    """A new package needs a decision."""
    internal = {"cli", "identify", "net", "pytest_plugin", "render", "tf", "workbench", "worker"}
    found = {module.name for module in pkgutil.iter_modules(kbot.__path__) if module.ispkg}
    assert found == {*PACKAGES, *internal}


class Held(Brief):
    """An object with any value."""

    def __init__(self, value: object) -> None:
        self._value = value

    @property
    def value(self) -> object:
        return self._value


class Broken:
    def __eq__(self, other: object) -> bool:
        raise TypeError("cannot be compared")

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        raise RuntimeError("has no repr")


def test_a_repr_of_any_value_is_no_error() -> None:
    inside: list[object] = []
    inside.append(inside)
    assert repr(Held(inside)) == "Held(value=[…])"
    held = Held(1)
    held._value = {"own": held}
    assert "…" in repr(held)
    for broken in (Held(Broken()), Held([Broken()]), Held.__new__(Held)):
        assert repr(broken).startswith(("<", "Held("))
