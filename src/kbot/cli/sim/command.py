"""`kbot sim`: simulate a robot in the browser, or headless as fast as possible."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING, NoReturn

import click

from kbot.cli.arguments import (
    PageOptions,
    collect_options,
    config_option,
    examples,
    file_and_arguments,
    goal_of,
    json_option,
    limits_of,
    output_file,
    package_path_option,
    page_options,
    pose_of,
    resolve_typed_names,
    speeds_of,
)
from kbot.cli.output import fail, print_note, report, report_for_page
from kbot.cli.progress import loading
from kbot.cli.run_outputs import PeerRequest, peer_options, record_options, run_outputs
from kbot.cli.sim.default_world import HEADLESS_WORLD, page_world
from kbot.cli.sim.goto import GotoRequest, run_goto
from kbot.cli.sim.headless import run_headless
from kbot.text import KbotError
from kbot.text.files import write_bytes

if TYPE_CHECKING:
    from kbot.kinematics import PlanarPose
    from kbot.learn.policies.policy import Policy
    from kbot.model.load import Loaded
    from kbot.navigation import Goals
    from kbot.navigation.goals.goal_options import GoalOptions
    from kbot.record.record_options import RecordOptions
    from kbot.sim import Simulation
    from kbot.workbench.displays.display_file import DisplayFile
    from kbot.workbench.session.session import Session

DURATION = 10.0
"""Seconds that a headless run takes without --duration."""


@dataclass(frozen=True, slots=True)
class _Setup:
    """The simulation: world, start pose, seed, and contact model."""

    world: str | None
    pose: str | None
    seed: int
    contacts: str

    @property
    def start(self) -> PlanarPose | None:
        return None if self.pose is None else pose_of("--pose", self.pose)

    @property
    def headless_world(self) -> str:
        return HEADLESS_WORLD if self.world is None else self.world


@dataclass(frozen=True, slots=True)
class _RunOptions:
    """How a headless run drives, how long it takes, and which files it writes."""

    duration: float | None
    cmd_vel: str | None
    script: str | None
    goto: str | None
    no_map: bool
    policy: str | None
    arrive: float | None
    max_speed: str | None
    plot: str | None
    shot: str | None
    as_json: bool

    @property
    def goal_options(self) -> GoalOptions:
        """The options of all goals. Invalid values end the program."""
        from kbot.navigation.goals.goal_options import GoalOptions  # imported lazily: it loads the engine

        max_speed = None if self.max_speed is None else limits_of("--max-speed", self.max_speed)
        return GoalOptions(self.no_map, self.arrive, max_speed)

    def goto_request(self, policy: Policy | None) -> GotoRequest | None:
        """The goal to drive to, and how. Invalid values end the program."""
        if self.goal is None:
            return None
        goal, has_heading = self.goal
        return GotoRequest(goal, has_heading, self.goal_options, self.duration, policy)

    def make_goals(self, policy: Policy | None) -> Callable[[Simulation], Goals]:
        """What makes the goals of a simulation. Invalid values end the program."""
        if policy is None:
            return self.goal_options.goals
        from kbot.learn.policies.driving import policy_goals
        from kbot.learn.policies.policy import ARRIVE

        arrive = ARRIVE if self.arrive is None else self.arrive
        return lambda simulation: policy_goals(simulation, policy, arrive)

    @property
    def goal(self) -> tuple[PlanarPose, bool] | None:
        """The goal, and whether its yaw counts. Invalid values end the program."""
        if self.goto is None:
            return None
        goal, has_heading = goal_of("--goto", self.goto)
        if self.policy is not None and has_heading:
            fail("--policy does not turn the robot at the goal. Remove YAW from --goto")
        return goal, has_heading

    def read_policy(self) -> Policy | None:
        """The policy that drives the robot. A file that is not a policy ends the program."""
        if self.policy is None:
            return None
        with loading(self.policy):
            from kbot.learn.policies.policy import Policy  # imported lazily, so that -h stays fast

            return Policy.read(self.policy)

    def refuse_without_headless(self) -> None:
        for name in ("duration", "cmd_vel", "plot", "shot"):
            if getattr(self, name) is not None:
                fail(f"--{name.replace('_', '-')} needs --headless")
        if self.as_json:
            fail("--json needs --headless")
        if self.goto is not None and self.script is not None:
            fail("--goto drives the robot. Remove --script")
        self._require_arrive()
        self._refuse_with_policy()

    def _require_arrive(self) -> None:
        if self.arrive is not None and not (math.isfinite(self.arrive) and self.arrive > 0.0):
            fail(f"--arrive takes a finite number of metres above 0, not {self.arrive}")

    def _refuse_with_policy(self) -> None:
        if self.policy is None:
            return
        if self.script is not None:
            fail("--policy drives the robot. Remove --script")
        if self.no_map:
            fail("--policy drives without a map. Remove --no-map")
        if self.max_speed is not None:
            fail("--policy has its own highest speeds. Remove --max-speed")

    def refuse_without_goals(self) -> None:
        """Without a page and without a bridge, the only goal is that of --goto."""
        if self.goto is not None:
            return
        if self.policy is not None:
            fail("--policy with --headless needs --goto or a bridge such as --ros1")
        for name in ("no_map", "arrive", "max_speed"):
            if getattr(self, name) not in (None, False):
                fail(f"--{name.replace('_', '-')} needs --goto or a bridge such as --ros1")

    def require_consistent(self) -> None:
        seconds = DURATION if self.duration is None else self.duration
        if not (math.isfinite(seconds) and seconds >= 0.0):
            fail(f"--duration takes a finite number of seconds, at least 0, not {seconds}")
        if self.script is not None and self.cmd_vel is not None:
            fail("--script drives the robot. Remove --cmd-vel")
        if self.script is not None and self.duration is not None:
            fail("--script sets the duration. Remove --duration")
        if self.goto is not None and (self.cmd_vel is not None or self.script is not None):
            fail("--goto drives the robot. Remove --cmd-vel and --script")
        if self.shot is not None and self.plot == self.shot:
            fail(f"--plot and --shot both write {self.plot}. Choose two different files")
        if self.goto is not None and self.plot is not None:
            fail("--plot does not work with --goto, only with --script and --cmd-vel")
        self._require_arrive()
        self._refuse_with_policy()


@click.command(
    "sim",
    epilog=examples(
        ("kbot sim kbot --world boxes", "drive in the browser"),
        ("kbot sim kbot --record run.mcap", "record the run"),
        ("kbot sim kbot --script drive.py", "watch a program drive"),
        ("kbot sim kbot --ros1", "connect to rostopic, tf and rviz"),
        "kbot sim kbot --world maze:size=8,seed=3 --pose 1,0,1.57",
        "kbot sim kbot --headless --duration 10 --cmd-vel 0.2,0",
        "kbot sim kbot --headless --world maze:size=4 --goto 1.8,1.8,0",
        "kbot sim kbot lidar:=true --headless --goto 1.8,1.8 --no-map",
        "kbot sim kbot lidar:=true --policy policy.onnx --goto 1.8,1.8",
        "kbot sim robot.xacro wheel_radius:=0.04 --headless --script drive.py --json",
    ),
)
@click.argument("words", nargs=-1, metavar="FILE [name:=value ...]")
@click.option(
    "--world",
    show_default="playground; with --headless empty",
    metavar="W",
    help="World to simulate in: a built-in world (empty, playground, boxes, maze, rooms, corridor, ramp, "
    "incline, stairs, obstacle_course, track), an SDF file or a map.yaml.",
)
@click.option(
    "--headless", is_flag=True, help="Simulate without a page, as fast as possible, and print a report."
)
@click.option(
    "--duration",
    type=float,
    metavar="S",
    show_default="10; for --goto estimated from the way",
    help="Time to simulate in seconds. For --goto, the time limit.",
)
@click.option(
    "--cmd-vel",
    metavar="V,W",
    help="Constant speeds: forward in m/s, turning in rad/s. VX,VY,W for a robot that also drives sideways: "
    "forward and left in m/s, turning in rad/s.",
)
@click.option(
    "--script",
    metavar="PY",
    help="Python file whose function drive(sim) drives the robot. The page starts it again when you save it.",
)
@click.option(
    "--goto",
    metavar="X,Y[,YAW]",
    help="Goal to drive to, in m, m and rad. Without YAW the heading at the goal is free.",
)
@click.option(
    "--no-map",
    is_flag=True,
    help="Drive to the goal with the robot's own lidars, wheel odometry and IMU, without a map or the "
    "true pose.",
)
@click.option(
    "--policy",
    metavar="ONNX",
    help="Policy that drives the robot to goals: a network in an ONNX file. It gets no map and not the true "
    "pose.",
)
@click.option(
    "--arrive",
    type=float,
    metavar="M",
    show_default="0.01; with --policy 0.2",
    help="Distance from the goal in m that counts as reached.",
)
@click.option(
    "--max-speed",
    metavar="V,W",
    show_default="0.3,2; with --no-map the robot's declared limits",
    help="Highest speeds on the way to the goal, in m/s and rad/s.",
)
@click.option(
    "--pose",
    show_default="0,0,0, or the nearest free place",
    metavar="X,Y,YAW",
    help="Start pose, in m, m and rad.",
)
@click.option(
    "--plot",
    callback=output_file(".png"),
    metavar="PNG",
    help="Write a plot of the true path and the odometry path to PNG.",
)
@click.option(
    "--shot",
    callback=output_file(".png"),
    metavar="PNG",
    help="Write a picture of robot and world at the end of the run to PNG.",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    metavar="N",
    help="Seed of the simulation's random numbers.",
)
@click.option(
    "--contacts",
    type=click.Choice(["recipe", "as-written"]),
    default="recipe",
    show_default=True,
    help="Contact model. recipe: wheels roll as spheres, casters slide freely. as-written: every shape "
    "collides as it is described.",
)
@json_option
@record_options
@peer_options
@package_path_option
@config_option
@page_options
@collect_options("setup", _Setup)
@collect_options("run", _RunOptions)
@click.pass_context
def command(
    ctx: click.Context,
    words: tuple[str, ...],
    headless: bool,
    setup: _Setup,
    run: _RunOptions,
    record: RecordOptions,
    peers: PeerRequest | None,
    package_path: tuple[str, ...],
    displays: DisplayFile | None,
    page: PageOptions,
) -> int:
    """Simulate a robot in a world.

    name:=value sets a xacro argument of FILE or, if FILE has no argument of that name, a top-level
    property.

    Without --headless, KBot serves a page in which you drive the robot. With --headless, two runs with
    the same inputs give the same result, bit for bit. A headless run with a bridge runs in real time,
    until Ctrl-C if there is no --duration.

    The options --duration, --cmd-vel, --plot, --shot and --json need --headless. Goals from the page, from
    rviz and from programs use --no-map, --arrive, --max-speed and --policy too.

    What a script prints goes to stdout, and with --json to stderr.

    Exit status: 0 success; 1 the goal was not reached, or the script failed by an assertion, by
    sys.exit with a status, or in a thread; 2 unusable input.
    """
    file, values = file_and_arguments(words)
    if headless:
        _refuse_without_page(ctx)
        run.require_consistent()
        if peers is None or not peers.is_live:
            run.refuse_without_goals()
        return _run_headless(file, values, setup, run, record, peers, package_path)
    run.refuse_without_headless()
    _serve(file, values, setup, run, record, peers, package_path, displays, page)
    return 0


def _serve(
    file: str,
    values: dict[str, str],
    setup: _Setup,
    run: _RunOptions,
    record: RecordOptions,
    peers: PeerRequest | None,
    package_path: tuple[str, ...],
    displays: DisplayFile | None,
    page: PageOptions,
) -> None:
    """Simulate in the page until Ctrl-C."""
    start, script = setup.start, run.script
    policy = run.read_policy()
    make_goals = run.make_goals(policy)
    goal, has_heading = run.goal or (None, False)
    with loading(file):
        # imported lazily, so that -h stays fast
        from kbot.checks.first_look import CONTROL, MESHES, first_look
        from kbot.model.load import load_robot, resolve_robot_path
        from kbot.world import load_world
        from kbot.xacro import Packages

        given = resolve_typed_names(file, values, package_path)
        loaded = load_robot(file, given.arguments, given.properties, Packages(package_path))
        found = first_look(loaded, (*MESHES, *CONTROL))
    report(found)
    report_for_page(loaded)
    with loading(setup.world or "the world"):
        robot = None if loaded.has_errors else loaded.robot
        world = page_world(robot) if setup.world is None else setup.world
        place = load_world(world)
    report(place.diagnostics)
    if script is not None:
        from kbot.sim.script import Script

        program = Script(script)
    with page.bound() as address, run_outputs(record, peers, served=True) as outputs:
        with loading(world):
            from kbot.sim.start_findings import START_CODES
            from kbot.workbench.serve import serve_session
            from kbot.workbench.session.driven_session import driven_session
            from kbot.workbench.source.description_file import DescriptionFile

            description = DescriptionFile(
                resolve_robot_path(file), given.arguments, package_path, properties=given.properties
            )

            def join(simulation: Simulation) -> None:
                if policy is not None:
                    from kbot.learn.policies.driving import fitted

                    try:
                        fitted(policy, simulation)
                    except KbotError as error:
                        if session is None:
                            raise
                        # the page refuses goals until the edited robot fits
                        print_note(f"the policy does not fit the robot: {error}")
                outputs.join(simulation, "", world)
                report(d for d in simulation.diagnostics if d.code in START_CODES)
                report(simulation.driver_findings)

            session: Session | None = None
            session = driven_session(
                description,
                place,
                world,
                setup.seed,
                setup.contacts,
                join,
                start,
                make_goals=make_goals,
                goal=goal,
                goal_has_heading=has_heading,
            )
        session.display_file = displays or session.display_file
        if script is not None or goal is not None:
            session.paused = session.waits_for_page = page.browser  # nobody misses the start
        if script is None:
            serve_session(session, address)
            return
        from kbot.workbench.script_loop import serve_script

        serve_script(session, program, address, outputs.interrupt)


def _run_headless(
    file: str,
    values: dict[str, str],
    setup: _Setup,
    run: _RunOptions,
    record: RecordOptions,
    peers: PeerRequest | None,
    package_path: tuple[str, ...],
) -> int:
    """Simulate without a page and return the exit status."""
    from kbot.sensors.declared import mount_declared

    speeds = None if run.cmd_vel is None else speeds_of("--cmd-vel", run.cmd_vel)
    policy = run.read_policy()
    request = run.goto_request(policy)
    if run.shot is not None:  # a missing library is reported before the run, which may take long
        from kbot.render.offscreen import require_offscreen

        require_offscreen()
    loaded, simulation = _simulation(file, values, setup, package_path)
    is_live = peers is not None and peers.is_live
    has_outputs = is_live or bool(record.path)
    if has_outputs:
        report(mount_declared(simulation)[1])
    if policy is not None:
        from kbot.learn.policies.driving import fitted

        fitted(policy, simulation)
    if is_live and request is None:
        from kbot.navigation import NavigationTopics

        NavigationTopics(simulation, run.make_goals(policy)(simulation))
    with ExitStack() as stack:
        outputs = None
        if has_outputs:
            outputs = stack.enter_context(run_outputs(record, peers))
            outputs.join(simulation, loaded.expansion.text, setup.headless_world)
        if request is not None:
            status = run_goto(simulation, request, run.as_json)
        else:
            if speeds is not None:
                simulation.cmd_vel(*speeds)
            in_real_time = is_live and run.script is None
            seconds = run.duration if in_real_time or run.duration is not None else DURATION
            status = run_headless(
                simulation,
                seconds,
                run.script,
                run.as_json,
                run.plot,
                in_real_time=in_real_time,
                raise_error=_raise if outputs is None else outputs.interrupt,
            )
        if run.shot is not None:
            _draw_end(simulation, run.shot)
    return status


def _raise(error: BaseException) -> NoReturn:
    raise error


def _draw_end(simulation: Simulation, path: str) -> None:
    from kbot.render.look import Look
    from kbot.render.picture import draw_picture
    from kbot.render.picture_scene import robot_in_world

    write_bytes(path, draw_picture(robot_in_world(simulation), Look()))


def _refuse_without_page(ctx: click.Context) -> None:
    for name in ("host", "port"):
        if ctx.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE:
            fail(f"--{name} is for the page, which --headless does not serve. For bridges, use --bridge-host")


def _simulation(
    file: str,
    values: dict[str, str],
    setup: _Setup,
    package_path: tuple[str, ...],
) -> tuple[Loaded, Simulation]:
    start = setup.start
    with loading(setup.headless_world):
        from kbot.checks.first_look import CONTROL, MESHES, first_look, merged_findings
        from kbot.model.load import load_robot
        from kbot.sim import Simulation
        from kbot.world import load_world
        from kbot.xacro import Packages

        place = load_world(setup.headless_world)
        given = resolve_typed_names(file, values, package_path)
        loaded = load_robot(file, given.arguments, given.properties, Packages(package_path))
        robot = loaded.require()
        simulation = Simulation(robot, place, setup.seed, contacts=setup.contacts, start=start)
        found = [
            *loaded.diagnostics,
            *first_look(loaded, (*MESHES, *CONTROL)),
            *merged_findings(loaded, simulation.diagnostics),
        ]
    report(found)
    return loaded, simulation
