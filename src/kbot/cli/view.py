"""`kbot view`: show a robot in the browser, with joint sliders, and reload it when a file is saved."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import (
    PageOptions,
    config_option,
    examples,
    file_and_arguments,
    output_file,
    package_path_option,
    page_options,
    resolve_typed_names,
    seconds_option,
)
from kbot.cli.output import fail, report, report_for_page
from kbot.cli.picture_options import look_options
from kbot.cli.progress import loading
from kbot.text.files import write_bytes

if TYPE_CHECKING:
    from kbot.render.look import Look
    from kbot.workbench.displays.display_file import DisplayFile


@click.command(
    "view",
    epilog=examples(
        "kbot view kbot",
        "kbot view robot.xacro wheel_radius:=0.04",
        "kbot view robot.urdf --no-browser --port 9000",
        ("kbot view run.mcap", "play back a recording"),
        ("kbot view run.mcap --at 12.5", "show a moment of a recording"),
        ("kbot view run.bag --robot robot.urdf", "show this robot in a recording"),
        ("kbot view robot.urdf -d robot.rviz", "use rviz's display configuration"),
        "kbot view robot.urdf --shot robot.png --size 800x600",
    ),
)
@click.argument("words", nargs=-1, required=True, metavar="FILE [name:=value ...]")
@click.option("--shot", callback=output_file(".png"), metavar="PNG", help="Write a picture to PNG and exit.")
@click.option(
    "--robot",
    metavar="FILE",
    help="Robot description for a recording, instead of the recorded one.",
)
@seconds_option(
    "--at", help="Time in a recording to open it at, in seconds from its start. Playback is paused."
)
@look_options
@page_options
@config_option
@package_path_option
def command(
    words: tuple[str, ...],
    page: PageOptions,
    displays: DisplayFile | None,
    package_path: tuple[str, ...],
    shot: str | None,
    robot: str | None,
    at: float | None,
    look: Look,
) -> None:
    """Show a robot or a recording in the browser.

    name:=value sets a xacro argument of FILE or, if FILE has no argument of that name, a top-level
    property.

    The page has a slider for each joint. It reloads the robot when you save FILE or a file that it
    includes. If there are errors, the page shows them with their lines and keeps the last valid robot. An
    empty or broken FILE opens an empty page, and the robot appears when you save a version without errors.

    A recording (.mcap, .bag or a rosbag2 folder) is played back with the robot that it contains, or
    with the one of --robot, for which name:=value then sets arguments. Without a robot, the page shows the
    recording's frames and sensors. Playback starts when the page opens. With --no-browser, it starts
    immediately.

    While kbot view runs, `kbot topic` and `kbot tf` can read joint states, frames and recorded topics.
    Ctrl-C stops kbot view.
    """
    path, values = file_and_arguments(words)
    from kbot.cli.run_outputs import run_outputs  # imported lazily, so that -h stays fast
    from kbot.record.names import is_recording

    if is_recording(path):
        if shot is not None or (values and robot is None):
            fail("a recording cannot be combined with --shot, nor with name:=value unless --robot is given")
        with loading(path):
            from kbot.model.load import resolve_robot_path
            from kbot.workbench.protocol import Seek
            from kbot.workbench.serve import serve_session
            from kbot.workbench.session.deadman import NOBODY
            from kbot.workbench.session.played_session import played_session

            given = resolve_typed_names(robot, values, package_path) if robot is not None else None
        with run_outputs(served=True) as outputs:
            with loading(path):
                session = played_session(
                    path,
                    package_path,
                    lambda played: outputs.show(played, played.description, path),
                    resolve_robot_path(robot) if robot is not None else "",
                    given.arguments if given is not None else None,
                    given.properties if given is not None else None,
                )
            session.display_file = displays or session.display_file
            session.paused = session.waits_for_page = page.browser
            if at is not None:
                session.waits_for_page = False
                session.paused = True
                session.handle(Seek(at), NOBODY)
            if session.note:
                click.echo(session.note, err=True)
            with page.bound() as address:
                serve_session(session, address)
        return
    if at is not None:
        fail(f"--at is a time in a recording, and {path} is not a recording")
    if robot is not None:
        fail(f"--robot gives the robot of a recording, and {path} is not a recording")
    with loading(path):
        from kbot.checks.first_look import MESHES, first_look
        from kbot.model.load import load_robot
        from kbot.xacro import Packages

        given = resolve_typed_names(path, values, package_path)
        loaded = load_robot(path, given.arguments, given.properties, Packages(package_path))
        found = first_look(loaded, MESHES)
    report(found)
    if shot is not None:
        from kbot.model.extensions import initial_positions
        from kbot.render.picture import draw_picture
        from kbot.render.picture_scene import robot_alone

        model = loaded.require()
        write_bytes(shot, draw_picture(robot_alone(model, initial_positions(model)), look))
        return
    report_for_page(loaded)
    with (
        page.bound() as address,
        run_outputs(served=True) as outputs,
    ):
        with loading(path):
            from kbot.model.writer import to_urdf
            from kbot.workbench.serve import open_session, serve_session

            session = open_session(
                path,
                simulate=False,
                arguments=given.arguments,
                properties=given.properties,
                package_path=package_path,
                on_show=lambda shown: outputs.show(shown, to_urdf(shown.robot), shown.robot.name),
            )
        session.display_file = displays or session.display_file
        serve_session(session, address)
