"""Compiles world and robots to one MuJoCo model, and again when a robot is spawned or deleted."""

from __future__ import annotations

import dataclasses
import re
import warnings
from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from kbot.sim.engine.contacts import GROUND
from kbot.sim.engine.placing import lowest_point, terrain_height
from kbot.sim.engine.robot_builder import RobotPlan, add_robot
from kbot.sim.engine.welds import Weld, add_weld
from kbot.sim.engine.world_builder import PREFIX, add_world, owner
from kbot.sim.recipe import IMPRATIO, Contacts
from kbot.text import DescriptionError, Diagnostic, DiagnosticCollector, KbotError, Origin, Severity
from kbot.world import World

_NAMED = re.compile(r"[Ee]lement(?: name)? '([^']+)'")
_DEGREE = re.compile(r"at DOF (\d+)")
_PART = re.compile(r"[#~]")
"""Between a body's name and the number of a shape or a joint of it."""


def compile_model(
    world: World, plans: Sequence[RobotPlan], timestep: float, welds: Sequence[Weld] = ()
) -> tuple[mujoco.MjModel, tuple[Diagnostic, ...]]:
    """The engine's model (MjModel) and what there is to warn of.

    Raises:
        DescriptionError: the world or a robot cannot be simulated; every reason at its line.
    """
    _keep_quiet()
    findings = DiagnosticCollector()
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


def _set_options(spec: mujoco.MjSpec, timestep: float, sleeps: bool) -> None:
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


def _warned_of(text: str, model: mujoco.MjModel, plans: Sequence[RobotPlan], world: World) -> Diagnostic:
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


DEEP = 0.002
"""Metres by which a new robot may reach into something and be pushed out by the contact."""


@dataclasses.dataclass(frozen=True)
class Assembly:
    """A world and the robots in it by name, compiled; `welds` are what is attached to what."""

    world: World
    contacts: Contacts
    timestep: float
    plans: Mapping[str, RobotPlan]
    model: mujoco.MjModel
    data: mujoco.MjData
    diagnostics: tuple[Diagnostic, ...]
    welds: tuple[Weld, ...] = ()

    @classmethod
    def of(
        cls,
        world: World,
        contacts: Contacts,
        timestep: float,
        plans: Mapping[str, RobotPlan],
        welds: tuple[Weld, ...] = (),
    ) -> Assembly:
        """Build it, every robot with its lowest point on the ground at its place.

        Raises:
            DescriptionError: the world or a robot cannot be simulated; every reason at its line.
        """
        met = {name: dataclasses.replace(plan, others=len(plans) > 1) for name, plan in plans.items()}
        model, diagnostics = compile_model(world, tuple(met.values()), timestep, welds)
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        geoms: dict[str, list[int]] = {name: [] for name in met}
        for geom in range(model.ngeom):
            geoms.setdefault(owner(model, geom).partition("/")[0], []).append(geom)
        for name, plan in met.items():
            _put_on_ground(model, data, plan, geoms[name])
        mujoco.mj_resetData(model, data)
        return cls(world, contacts, timestep, met, model, data, diagnostics, welds)

    def with_robot(self, plan: RobotPlan) -> Assembly:
        """The same with one more robot, everything else as it stands now.

        Raises:
            DescriptionError: the robot cannot be simulated.
            KbotError: it would stand inside something; this assembly is left as it is.
        """
        other = self._with({**self.plans, plan.name: plan}, self.welds)
        inside = other.what_it_is_inside(plan)
        if inside:
            raise KbotError(f"'{plan.name}' cannot stand there: it would be inside '{inside}'")
        return other

    def without_robot(self, name: str) -> Assembly:
        """The same without a robot, everything else as it stands now."""
        plans = {key: plan for key, plan in self.plans.items() if key != name}
        gone = f"{name}/"
        welds = (w for w in self.welds if not (w.first.startswith(gone) or w.second.startswith(gone)))
        return self._with(plans, tuple(welds))

    def with_world(self, world: World) -> Assembly:
        """The same in a world with other bodies; what is in both stands as it does now.

        Raises:
            DescriptionError: the world cannot be simulated.
        """
        names = {PREFIX + body.name for body in self.world.bodies} - {PREFIX + b.name for b in world.bodies}
        welds = tuple(weld for weld in self.welds if not names & {weld.first, weld.second})
        return dataclasses.replace(self, world=world)._with(self.plans, welds)

    def with_welds(self, welds: tuple[Weld, ...]) -> Assembly:
        """The same with just these attached to each other, everything else as it stands now."""
        return self._with(self.plans, welds)

    def _with(self, plans: Mapping[str, RobotPlan], welds: tuple[Weld, ...]) -> Assembly:
        other = Assembly.of(self.world, self.contacts, self.timestep, plans, welds)
        _carry_over(self.model, self.data, other.model, other.data)
        return other

    def let_things_be_as_in(self, other: Assembly) -> None:
        """Let the world's bodies stand and move as they do in another assembly; robots stay as they are."""
        _carry_over(other.model, other.data, self.model, self.data, PREFIX)

    def height(self, root_qpos: int) -> float:
        """Metres at which a robot's root stands at the start."""
        return float(self.model.qpos0[root_qpos + 2])

    def what_it_is_inside(self, plan: RobotPlan) -> str:
        """What a robot reaches deep into as it stands now, the ground left out; empty for nothing.

        Raises:
            DescriptionError: the engine cannot compute the contacts.
        """
        trial = mujoco.MjData(self.model)
        mujoco.mj_copyData(trial, self.model, self.data)
        try:
            mujoco.mj_forward(self.model, trial)
        except mujoco.FatalError as error:  # more contacts than its memory holds
            reason = str(error).splitlines()[0]
            message = f"the physics engine refuses the world with '{plan.name}' in it: {reason}"
            hint = "let fewer objects stand in one place"
            raise DescriptionError([Diagnostic("W110", Severity.ERROR, message, None, hint)]) from None
        for contact in trial.contact:
            ground = any(self.model.geom_contype[g] == GROUND for g in contact.geom)
            if contact.dist >= -DEEP or ground:
                continue
            names = [owner(self.model, int(geom)) for geom in contact.geom]
            own = [name.startswith(plan.prefix) for name in names]
            if any(own):
                return (names[own.index(False)] if False in own else names[0]).strip("/")
        return ""


def _put_on_ground(model: mujoco.MjModel, data: mujoco.MjData, plan: RobotPlan, geoms: list[int]) -> None:
    root = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, plan.prefix)
    lowest = lowest_point(model, data, geoms)
    if root >= 0 and lowest is not None:
        x, y, _ = plan.pose.translation.tolist()
        ground = terrain_height(model, data, x, y) or 0.0
        model.qpos0[model.jnt_qposadr[root] + 2] += ground - lowest


_POSITIONS = {0: 7, 1: 4, 2: 1, 3: 1}
_SPEEDS = {0: 6, 1: 3, 2: 1, 3: 1}


def _carry_over(
    old: mujoco.MjModel, before: mujoco.MjData, new: mujoco.MjModel, after: mujoco.MjData, prefix: str = ""
) -> None:
    """Positions, speeds and servo states of everything that is in both models, by names that begin so."""
    after.time = before.time
    for index in range(old.njnt):
        name = old.joint(index).name
        there = mujoco.mj_name2id(new, mujoco.mjtObj.mjOBJ_JOINT, name)
        if there < 0 or not name.startswith(prefix):
            continue
        kind = int(old.jnt_type[index])
        _copy(before.qpos, old.jnt_qposadr[index], after.qpos, new.jnt_qposadr[there], _POSITIONS[kind])
        for field in ("qvel", "qacc_warmstart"):
            _copy(
                getattr(before, field), old.jnt_dofadr[index],
                getattr(after, field), new.jnt_dofadr[there], _SPEEDS[kind],
            )  # fmt: skip
    for index in range(old.nu):
        name = old.actuator(index).name
        there = mujoco.mj_name2id(new, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
        if there < 0 or not name.startswith(prefix):
            continue
        after.ctrl[there] = before.ctrl[index]
        if old.actuator_actadr[index] >= 0:
            after.act[new.actuator_actadr[there]] = before.act[old.actuator_actadr[index]]


def _copy(source: np.ndarray, start: int, target: np.ndarray, place: int, count: int) -> None:
    target[place : place + count] = source[start : start + count]
