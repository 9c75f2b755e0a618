"""Checks the robots that a launch simulates."""

from __future__ import annotations

from kbot.model.load import load_robot
from kbot.model.spawned import with_controllers
from kbot.ros.launch.staging import Stage
from kbot.text import Diagnostic
from kbot.xacro import Packages


def simulation_findings(stage: Stage, packages: Packages) -> tuple[Diagnostic, ...]:
    """Findings about the spawned controllers and the hardware of the robots that are simulated."""
    if not stage.is_simulated:
        return ()
    from kbot.checks.first_look import (
        CONTROL,
        first_look,
        merged_findings,
    )  # imported lazily, for a fast start-up of launches without a simulation
    from kbot.sim.preparation import controller_findings

    findings: list[Diagnostic] = []
    for spawned in stage.robots:
        loaded = load_robot(spawned.path, spawned.arguments, packages=packages)
        findings += first_look(loaded, CONTROL)
        if spawned.controllers and loaded.robot is not None:
            findings += merged_findings(
                loaded, controller_findings(with_controllers(loaded.robot, spawned.controllers))
            )
    return tuple(findings)
