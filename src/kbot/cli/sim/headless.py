"""A run without a page: by a held command or a script, and the report at its end."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from kbot.cli.output import print_json
from kbot.text.files import write_bytes

if TYPE_CHECKING:
    from kbot.sim import Simulation

INTERRUPTED = 130
"""The exit status after Ctrl-C, as a shell has it."""


def run_headless(
    simulation: Simulation,
    seconds: float | None,
    script: str | None,
    as_json: bool,
    plot: str | None,
    in_real_time: bool = False,
) -> int:
    """Run, then report on stdout; the exit status. `seconds` None is until Ctrl-C."""
    from kbot.cli.sim.progress import Progress  # lazy in this module: -h is fast
    from kbot.sim.report import Odometer, make_report
    from kbot.sim.script import ScriptFailed, run_script

    odometer = Odometer(simulation, keeps=plot is not None)
    failed: ScriptFailed | None = None
    interrupted = False
    with Progress(simulation, seconds if script is None else None) as progress:
        try:
            if in_real_time or seconds is None:
                from kbot.sim.real_time import run_in_real_time

                run_in_real_time(simulation, seconds)
            elif script is None:
                simulation.run(seconds)
            else:
                run_script(script, simulation)
        except ScriptFailed as failure:
            failed = failure
        except KeyboardInterrupt:  # what was simulated until then is reported
            interrupted = True
    odometer.close()
    result = make_report(simulation, odometer.distance, progress.wall)
    if as_json:
        print_json({**result.to_json(), **({"failure": failed.to_json()} if failed else {})})
    else:
        click.echo(result.to_text())
    if failed is not None:
        sys.stderr.write(f"{failed}\n")
    if interrupted:
        click.echo(f"interrupted at {simulation.time:.3f} s", err=True)
    if plot is not None:  # after the report, which is not lost where no picture can be written
        from kbot.render.path_plot import draw

        believed = [simulation.start @ pose for pose in odometer.odometry]
        title = f"{simulation.robot.name} in {simulation.world.name}, {simulation.time:.2f} s from above"
        write_bytes(plot, draw(odometer.truth, believed, simulation.world, title))
    if interrupted:
        return INTERRUPTED
    return 1 if failed is not None else 0
