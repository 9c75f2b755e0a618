"""World and robots put together into one model of the engine, its errors led back to their lines."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from typing import Any

import mujoco

from kbot.sim.engine.robot_builder import RobotPlan, add_robot
from kbot.sim.engine.welds import Weld, add_weld
from kbot.sim.engine.world_builder import add_world
from kbot.sim.recipe import IMPRATIO
from kbot.text import DescriptionError, Diagnostic, Origin, Severity
from kbot.world import World
from kbot.world.findings import Findings

_NAMED = re.compile(r"[Ee]lement(?: name)? '([^']+)'")
_DEGREE = re.compile(r"at DOF (\d+)")
_PART = re.compile(r"[#~]")
"""Between a body's name and the number of a shape or a joint of it."""


def compile_model(
    world: World, plans: Sequence[RobotPlan], timestep: float, welds: Sequence[Weld] = ()
) -> tuple[Any, tuple[Diagnostic, ...]]:
    """The engine's model (MjModel) and what there is to warn of.

    Raises:
        DescriptionError: the world or a robot cannot be simulated; every reason at its line.
    """
    _keep_quiet()
    findings = Findings()
    spec = mujoco.MjSpec()
    _set_options(spec, timestep, sleeps=any(not body.is_static for body in world.bodies))
    add_world(spec, world, findings)
    for plan in plans:
        add_robot(spec, plan, findings)
    for weld in welds:
        add_weld(spec, weld, timestep)
    findings.require()
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            model = spec.compile()
        except ValueError as error:
            raise DescriptionError([_refused(str(error), plans, world)]) from None
    told = (_warned_of(str(one.message), model, plans, world) for one in warned)
    return model, (*findings.diagnostics, *told)


def _keep_quiet() -> None:
    """The engine would write a log file into the working directory; the simulation speaks for itself."""
    config = mujoco.MjLogConfig.get()
    config.logto_file = config.logto_console = False
    config.set()


def _set_options(spec: Any, timestep: float, sleeps: bool) -> None:
    option = spec.option
    option.timestep = timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = IMPRATIO
    # a run that diverges is to be noticed, not begun anew in silence
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    if sleeps:
        option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    spec.compiler.degree = False


def _refused(text: str, plans: Sequence[RobotPlan], world: World) -> Diagnostic:
    """The engine's words at the line of the element they speak of."""
    reason = text.removeprefix("Error: ").splitlines()[0]
    named = _NAMED.search(text)
    what, where = _element(named[1], plans, world) if named else ("", None)
    return Diagnostic("W110", Severity.ERROR, f"{what}the physics engine refuses it: {reason}", where)


def _warned_of(text: str, model: Any, plans: Sequence[RobotPlan], world: World) -> Diagnostic:
    """A warning of the engine at the line of the joint it speaks of."""
    reason = text.partition(" Time = ")[0]
    degree = _DEGREE.search(text)
    joint = model.joint(int(model.dof_jntid[int(degree[1])])).name if degree else ""
    what, where = _element(joint, plans, world) if joint else ("", None)
    return Diagnostic("W110", Severity.WARNING, f"{what}the physics engine warns: {reason}", where)


def _element(named: str, plans: Sequence[RobotPlan], world: World) -> tuple[str, Origin | None]:
    """What the engine's name of an element stands for, as the beginning of a sentence, and its line."""
    owner, _, name = named.partition("/")
    plan = next((p for p in plans if p.name == owner), None)
    if plan is not None:
        element = plan.robot.links.get(name) or plan.robot.joints.get(name.partition(":")[0])
        return f"'{name}': ", element.origin if element else plan.robot.origin
    body = next((b for b in world.bodies if b.name == _PART.split(name)[0]), None)
    return f"'{body.name if body else named}': ", body.origin if body else None
