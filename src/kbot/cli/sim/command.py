"""`kbot sim`: drive a robot in a world, in the browser or as fast as the machine can."""

from __future__ import annotations

import math
from contextlib import ExitStack
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import (
    PageOptions,
    config_option,
    examples,
    json_option,
    one_file,
    package_path_option,
    page_options,
    picture_file,
    pose_of,
    resolve_typed_names,
    speeds_of,
)
from kbot.cli.output import fail, report
from kbot.cli.outputs import PeerRequest, peer_options, record_options, run_outputs
from kbot.cli.progress import loading
from kbot.cli.sim.headless import run_goto, run_headless
from kbot.text.files import write_bytes

if TYPE_CHECKING:
    from kbot.kinematics import PlanarPose
    from kbot.model.load import Loaded
    from kbot.record.record_options import RecordOptions
    from kbot.sim import Simulation
    from kbot.workbench.displays.display_file import DisplayFile

DURATION = 10.0


@click.command(
    "sim",
    epilog=examples(
        ("kbot sim kbot --world boxes", "drive in the browser"),
        ("kbot sim kbot --record run.mcap", "record the run"),
        ("kbot sim kbot --ros1", "connect to rostopic, tf and rviz"),
        "kbot sim kbot --world maze:size=8,seed=3 --pose 1,0,1.57",
        "kbot sim kbot --headless --duration 10 --cmd-vel 0.2,0",
        "kbot sim kbot --headless --world maze:size=4 --goto 1.8,1.8,0",
        "kbot sim robot.xacro wheel_radius:=0.04 --headless --script drive.py --json",
    ),
)
@click.argument("words", nargs=-1, metavar="FILE [name:=value ...]")
@click.option(
    "--world",
    default="empty",
    show_default=True,
    metavar="W",
    help="World to simulate in: a built-in name, an SDF file or a map.yaml.",
)
@click.option(
    "--headless", is_flag=True, help="Simulate without a page, as fast as possible, and print a report."
)
@click.option(
    "--duration",
    type=float,
    metavar="S",
    show_default="10; for --goto estimated from the path",
    help="Time to simulate in seconds. For --goto, the time limit.",
)
@click.option("--cmd-vel", metavar="V,W", help="Constant speeds: forward in m/s, turning in rad/s.")
@click.option("--script", metavar="PY", help="Python file whose function drive(sim) drives the robot.")
@click.option("--goto", metavar="X,Y,YAW", help="Goal pose to drive to, in m, m and rad.")
@click.option(
    "--pose",
    default="0,0,0",
    show_default=True,
    metavar="X,Y,YAW",
    help="Start pose, in m, m and rad.",
)
@click.option(
    "--plot",
    callback=picture_file,
    metavar="PNG",
    help="Write a plot of the true path and the odometry path to PNG.",
)
@click.option(
    "--shot",
    callback=picture_file,
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
@click.pass_context
def command(
    ctx: click.Context,
    words: tuple[str, ...],
    world: str,
    headless: bool,
    duration: float | None,
    cmd_vel: str | None,
    script: str | None,
    goto: str | None,
    pose: str,
    plot: str | None,
    shot: str | None,
    seed: int,
    contacts: str,
    as_json: bool,
    package_path: tuple[str, ...],
    page: PageOptions,
    displays: DisplayFile | None,
    record: RecordOptions,
    peers: PeerRequest | None,
) -> int:
    """Simulate a robot in a world.

    name:=value sets a xacro argument of FILE or, if FILE has no argument of that name, a top-level
    property.

    Without --headless, KBot serves a page in which you drive the robot. With --headless, two runs with
    the same inputs give the same result, bit for bit. A headless run with a bridge runs in real time,
    until Ctrl-C if there is no --duration.

    The options --duration, --cmd-vel, --script, --goto, --plot, --shot and --json need --headless.

    Exit status: 0 fine; 1 the goal was not reached or an assertion of the script failed; 2 unusable
    input.
    """
    file, values = one_file(words)
    if not headless:
        _refuse_without_headless(
            duration=duration,
            cmd_vel=cmd_vel,
            script=script,
            goto=goto,
            plot=plot,
            shot=shot,
            json=as_json or None,
        )
        start = pose_of("--pose", pose)
        with loading(file):
            # lazy in this module: -h is fast
            from kbot.checks.first_look import CONTROL, MESHES, first_look
            from kbot.model.load import load_robot, resolve_robot_path
            from kbot.world import load_world
            from kbot.xacro import Packages

            given = resolve_typed_names(file, values, package_path)
            loaded = load_robot(file, given.arguments, given.properties, Packages(package_path))
            found = first_look(loaded, (*MESHES, *CONTROL))
        report(found)
        loaded.require()
        with loading(world):
            place = load_world(world)
        with (
            page.bound() as address,
            run_outputs(record, peers, served=True) as outputs,
        ):
            with loading(world):
                from kbot.workbench.serve import serve_session
                from kbot.workbench.session.driven_session import driven_session
                from kbot.workbench.source.description import DescriptionFile

                description = DescriptionFile(
                    resolve_robot_path(file), given.arguments, package_path, properties=given.properties
                )
                session = driven_session(
                    description,
                    place,
                    world,
                    seed,
                    contacts,
                    lambda simulation: outputs.join(simulation, "", world),
                    start,
                )
            session.display_file = displays or session.display_file
            serve_session(session, address)
        return 0
    _refuse_without_page(ctx)
    seconds = DURATION if duration is None else duration
    if not (math.isfinite(seconds) and seconds >= 0.0):
        fail(f"--duration is a finite number of seconds from 0 on, not {seconds}")
    speeds = None if cmd_vel is None else speeds_of("--cmd-vel", cmd_vel)
    if script is not None and cmd_vel is not None:
        fail("--script drives the robot itself; leave --cmd-vel out")
    if script is not None and duration is not None:
        fail("--script says itself how long to run; leave --duration out")
    if goto is not None and (cmd_vel is not None or script is not None):
        fail("--goto drives the robot itself; leave --cmd-vel and --script out")
    if shot is not None and plot == shot:
        fail(f"--plot and --shot both draw {plot}: name two files")
    if goto is not None and plot is not None:
        fail("--plot is for --script and --cmd-vel; leave it out with --goto")
    goal = None if goto is None else pose_of("--goto", goto)
    from kbot.sensors.declared import mount_declared

    if shot is not None:  # said before the run, which takes its time
        from kbot.render.offscreen import require_offscreen

        require_offscreen()
    start = pose_of("--pose", pose)
    loaded, simulation = _simulation(file, values, world, seed, contacts, package_path, start)
    is_live = peers is not None and peers.is_live
    has_outputs = is_live or bool(record.path)
    if has_outputs:
        report(mount_declared(simulation)[1])
    if is_live and goal is None:
        from kbot.navigation import Goals, NavigationTopics

        NavigationTopics(simulation, Goals(simulation, in_background=True))
    with ExitStack() as stack:
        if has_outputs:
            stack.enter_context(run_outputs(record, peers)).join(simulation, loaded.expansion.text, world)
        if goal is not None:
            status = run_goto(simulation, goal, duration, as_json)
        else:
            if speeds is not None:
                simulation.cmd_vel(*speeds)
            live = is_live and script is None
            status = run_headless(
                simulation, duration if live else seconds, script, as_json, plot, in_real_time=live
            )
        if shot is not None:
            _draw_end(simulation, shot)
    return status


def _draw_end(simulation: Simulation, path: str) -> None:
    from kbot.render.look import Look
    from kbot.render.picture import draw_picture
    from kbot.render.picture_scene import robot_in_world

    write_bytes(path, draw_picture(robot_in_world(simulation), Look()))


def _refuse_without_headless(**options: object) -> None:
    for name, value in options.items():
        if value is not None:
            fail(f"--{name.replace('_', '-')} goes with --headless")


def _refuse_without_page(ctx: click.Context) -> None:
    for name in ("host", "port"):
        if ctx.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE:
            fail(f"--{name} is of the page, which --headless leaves out; for bridges there is --bridge-host")


def _simulation(
    file: str,
    values: dict[str, str],
    world: str,
    seed: int,
    contacts: str,
    package_path: tuple[str, ...],
    start: PlanarPose,
) -> tuple[Loaded, Simulation]:
    with loading(world):
        from kbot.checks.first_look import CONTROL, MESHES, first_look, folded
        from kbot.model.load import load_robot
        from kbot.sim import Simulation
        from kbot.world import load_world
        from kbot.xacro import Packages

        place = load_world(world)
        given = resolve_typed_names(file, values, package_path)
        loaded = load_robot(file, given.arguments, given.properties, Packages(package_path))
        robot = loaded.require()
        simulation = Simulation(robot, world=place, seed=seed, contacts=contacts, start=start)
        found = [
            *loaded.diagnostics,
            *first_look(loaded, (*MESHES, *CONTROL)),
            *folded(loaded, simulation.diagnostics),
        ]
    report(found)
    return loaded, simulation
