"""`kbot view`: a robot in the browser, with sliders for its joints, anew with every save."""

from __future__ import annotations

import click

from kbot.cli.arguments import examples, one_file, package_path_option, page_options
from kbot.cli.output import report


@click.command(
    "view",
    epilog=examples(
        "kbot view kbot",
        "kbot view robot.xacro wheel_radius:=0.04",
        "kbot view robot.urdf --no-browser --port 9000",
    ),
)
@click.argument("words", nargs=-1, required=True, metavar="FILE [NAME:=VALUE]…")
@page_options
@package_path_option
def command(
    words: tuple[str, ...], host: str, port: int | None, browser: bool, package_path: tuple[str, ...]
) -> None:
    """Show a robot in the browser, with sliders for its joints.

    Each save of the file, or of one that it includes, shows the new robot; a broken file keeps the
    last good one on screen and says what is wrong, at the line. Ctrl-C ends it.
    """
    path, arguments = one_file(words)
    from kbot.checks.first_look import MESHES, first_look
    from kbot.model.load import load_robot
    from kbot.workbench import serve
    from kbot.xacro import Packages

    report(first_look(load_robot(path, arguments, packages=Packages(package_path)), MESHES))
    serve(
        path,
        simulate=False,
        arguments=arguments,
        host=host,
        port=port,
        open_browser=browser,
        package_path=package_path,
    )
