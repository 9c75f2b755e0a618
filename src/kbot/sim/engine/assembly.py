"""Compiles the world and the robots to one MuJoCo model, and recompiles it after a spawn or delete."""

from __future__ import annotations

import dataclasses
import re
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from copy import copy

import mujoco
import numpy as np

from kbot.sim.engine.contacts import GROUNDS
from kbot.sim.engine.geometry import wxyz
from kbot.sim.engine.placing import ground_height, lowest_point, places_around
from kbot.sim.engine.robot_builder import RobotPlan, add_robot
from kbot.sim.engine.welds import Weld, add_weld
from kbot.sim.engine.world_builder import PREFIX, add_world, owner, planes_of
from kbot.sim.recipe import IMPRATIO, Contacts
from kbot.text import DescriptionError, Diagnostic, DiagnosticCollector, KbotError, Origin, Severity
from kbot.text.diagnostic import one_per_cause
from kbot.text.progress import working_on
from kbot.world import World

_NAMED = re.compile(r"[Ee]lement(?: name)? '([^']+)'")
_DEGREE = re.compile(r"at DOF (\d+)")
_PART = re.compile(r"[#~]")
"""The separator between a body's name and the number of its shape or joint."""


def compile_model(
    world: World, plans: Sequence[RobotPlan], timestep: float, welds: Sequence[Weld] = ()
) -> tuple[mujoco.MjModel, tuple[Diagnostic, ...]]:
    """The engine's model, and warnings.

    Raises:
        DescriptionError: the world or a robot cannot be simulated. It carries every reason with its line.
    """
    _disable_engine_log()
    findings = DiagnosticCollector()
    spec = build_spec(world, plans, timestep, welds, findings)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        working_on(f"the physics engine computes the hulls of {len(spec.meshes)} meshes")
        try:
            model = spec.compile()
        except ValueError as error:
            raise DescriptionError([_error(str(error), plans, world)]) from None
    engine_warnings = (_warning(str(entry.message), model, plans, world) for entry in warned)
    return model, (*one_per_cause(findings.diagnostics), *engine_warnings)


def build_spec(
    world: World,
    plans: Sequence[RobotPlan],
    timestep: float,
    welds: Sequence[Weld],
    findings: DiagnosticCollector,
) -> mujoco.MjSpec:
    """The engine's model before it is compiled. Warnings are added to `findings`.

    Raises:
        DescriptionError: the world or a robot cannot be simulated. It carries every reason with its line.
    """
    spec = mujoco.MjSpec()
    _set_options(spec, timestep, sleeps=any(not body.is_static for body in world.bodies))
    grounds = add_world(spec, world, findings)
    for plan in plans:
        add_robot(spec, plan, grounds, planes_of(world), findings)
    for weld in welds:
        add_weld(spec, weld, timestep)
    findings.require()
    return spec


def _disable_engine_log() -> None:
    """MuJoCo would write a log file to the working directory. KBot reports its errors and warnings itself."""
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
    # by default MuJoCo resets a diverged simulation silently; KBot reports it instead
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    if sleeps:
        option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    spec.compiler.degree = False


def _error(text: str, plans: Sequence[RobotPlan], world: World) -> Diagnostic:
    """An error of the engine at the line of the element that it names."""
    reason = text.removeprefix("Error: ").splitlines()[0]
    named = _NAMED.search(text)
    what, where = _element(named[1], plans, world) if named else ("", None)
    return Diagnostic("W110", Severity.ERROR, f"{what}the physics engine rejects it: {reason}", where)


def _warning(text: str, model: mujoco.MjModel, plans: Sequence[RobotPlan], world: World) -> Diagnostic:
    """A warning of the engine at the line of the joint that it names."""
    reason = text.partition(" Time = ")[0]
    degree = _DEGREE.search(text)
    joint = model.joint(int(model.dof_jntid[int(degree[1])])).name if degree else ""
    what, where = _element(joint, plans, world) if joint else ("", None)
    return Diagnostic("W110", Severity.WARNING, f"{what}the physics engine warns: {reason}", where)


def _element(named: str, plans: Sequence[RobotPlan], world: World) -> tuple[str, Origin | None]:
    """The start of a message about an element with this engine name, and the element's line."""
    owner, _, name = named.partition("/")
    plan = next((p for p in plans if p.name == owner), None)
    if plan is not None:
        element = plan.robot.links.get(name) or plan.robot.joints.get(name.partition(":")[0])
        return f"'{name}': ", element.origin if element else plan.robot.origin
    body = next((b for b in world.bodies if b.name == _PART.split(name)[0]), None)
    return f"'{body.name if body else named}': ", body.origin if body else None


DEEP = 0.002
"""Metres by which a new robot may overlap something: the contact then pushes it out."""


@dataclasses.dataclass(frozen=True)
class Assembly:
    """A compiled world with its robots by name. `welds` are the attachments."""

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
        """Compile an assembly, with every robot's lowest point on the ground at its start pose.

        Raises:
            DescriptionError: the world or a robot cannot be simulated. It carries every reason with its line.
        """
        met = {name: dataclasses.replace(plan, others=len(plans) > 1) for name, plan in plans.items()}
        model, diagnostics = compile_model(world, tuple(met.values()), timestep, welds)
        return cls(world, contacts, timestep, met, model, _started(model, met), diagnostics, welds)

    def with_start(self, plan: RobotPlan) -> Assembly:
        """A copy at the start, in which a robot that is not fixed starts at the pose of another plan.

        It equals one that is compiled from that plan, which takes seconds for thousands of shapes.
        """
        model, pose = copy(self.model), plan.pose
        root = model.body(plan.prefix + plan.robot.root).id
        at = int(model.jnt_qposadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, plan.prefix)])
        model.body_pos[root], model.body_quat[root] = pose.translation, wxyz(pose)
        for start in (model.qpos0, model.qpos_spring):
            start[at : at + 7] = (*model.body_pos[root], *model.body_quat[root])
        mujoco.mj_setConst(model, mujoco.MjData(model))  # as the compiler does at its end
        plans = {**self.plans, plan.name: dataclasses.replace(plan, others=len(self.plans) > 1)}
        return dataclasses.replace(self, plans=plans, model=model, data=_started(model, plans))

    def with_robot(self, plan: RobotPlan) -> Assembly:
        """A copy of the current state with one more robot.

        Raises:
            DescriptionError: the robot cannot be simulated.
            KbotError: the robot would overlap something.
        """
        other = self._with({**self.plans, plan.name: plan}, self.welds)
        inside = other.overlapped_by(plan)
        if inside:
            raise KbotError(f"'{plan.name}' cannot be placed there: it would overlap '{inside}'")
        return other

    def without_robot(self, name: str) -> Assembly:
        """A copy of the current state without a robot."""
        plans = {key: plan for key, plan in self.plans.items() if key != name}
        prefix = f"{name}/"
        welds = (w for w in self.welds if not (w.first.startswith(prefix) or w.second.startswith(prefix)))
        return self._with(plans, tuple(welds))

    def with_world(self, world: World) -> Assembly:
        """A copy with another world. Bodies that are in both worlds keep their state.

        Raises:
            DescriptionError: the world cannot be simulated.
        """
        names = {PREFIX + body.name for body in self.world.bodies} - {PREFIX + b.name for b in world.bodies}
        welds = tuple(weld for weld in self.welds if not names & {weld.first, weld.second})
        return dataclasses.replace(self, world=world)._with(self.plans, welds)

    def with_welds(self, welds: tuple[Weld, ...]) -> Assembly:
        """A copy of the current state with exactly these attachments."""
        return self._with(self.plans, welds)

    def _with(self, plans: Mapping[str, RobotPlan], welds: tuple[Weld, ...]) -> Assembly:
        other = Assembly.of(self.world, self.contacts, self.timestep, plans, welds)
        _carry_over(self.model, self.data, other.model, other.data)
        return other

    def copy_bodies_from(self, other: Assembly) -> None:
        """Copy the state of the world's bodies from another assembly. Robots keep their state."""
        _carry_over(other.model, other.data, self.model, self.data, PREFIX)

    def height(self, root_qpos: int) -> float:
        """Height in m of a robot's root at the start."""
        return float(self.model.qpos0[root_qpos + 2])

    def overlapped_by(self, plan: RobotPlan) -> str:
        """The name of a body that a robot overlaps by more than `DEEP`, not the ground. Empty for none.

        Raises:
            DescriptionError: the engine cannot compute the contacts.
        """
        trial = mujoco.MjData(self.model)
        mujoco.mj_copyData(trial, self.model, self.data)
        try:
            mujoco.mj_forward(self.model, trial)
        except mujoco.FatalError as error:  # more contacts than its memory holds
            reason = str(error).splitlines()[0]
            message = f"the physics engine rejects the world with '{plan.name}': {reason}"
            hint = "reduce the number of objects in one place"
            raise DescriptionError([Diagnostic("W110", Severity.ERROR, message, None, hint)]) from None
        return self._overlapped(trial, plan)

    def free_place(self, plan: RobotPlan) -> tuple[float, float] | None:
        """The x and y in m, nearest to a robot's start, at which it overlaps nothing. None if there is none.

        A robot that is fixed to the world has no other place.
        """
        root = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_JOINT, plan.prefix)
        if root < 0:
            return None
        trial = mujoco.MjData(self.model)
        at = int(self.model.jnt_qposadr[root])
        x, y, z = self.model.qpos0[at : at + 3].tolist()
        mujoco.mj_kinematics(self.model, trial)
        above_ground = z - ground_height(self.model, trial, x, y)
        for dx, dy in places_around():
            ground = ground_height(self.model, trial, x + dx, y + dy)
            trial.qpos[at : at + 3] = x + dx, y + dy, above_ground + ground
            mujoco.mj_kinematics(self.model, trial)
            with suppress(mujoco.FatalError):  # more contacts than its memory holds
                mujoco.mj_collision(self.model, trial)
                if not self._overlapped(trial, plan):
                    return x + dx, y + dy
        return None

    def _overlapped(self, trial: mujoco.MjData, plan: RobotPlan) -> str:
        # in arrays, because a world of thousands of objects has as many contacts
        contacts = trial.contact
        on_ground = (self.model.geom_contype[contacts.geom] & GROUNDS).any(axis=1)
        for pair in contacts.geom[(contacts.dist < -DEEP) & ~on_ground].tolist():
            names = [owner(self.model, geom) for geom in pair]
            own = [name.startswith(plan.prefix) for name in names]
            if any(own):
                return (names[own.index(False)] if False in own else names[0]).strip("/")
        return ""


def _started(model: mujoco.MjModel, plans: Mapping[str, RobotPlan]) -> mujoco.MjData:
    """The state at the start, with the lowest point of every robot on the ground."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geoms: dict[str, list[int]] = {name: [] for name in plans}
    for geom in np.flatnonzero(model.geom_bodyid).tolist():  # the others are static shapes of the world
        geoms.setdefault(owner(model, geom).partition("/")[0], []).append(geom)
    for name, plan in plans.items():
        _put_on_ground(model, data, plan, geoms[name])
    mujoco.mj_resetData(model, data)
    return data


_PRESSED = 1e-9
"""Metres by which a robot starts in the ground. Wheels that only touch it turn freely in the first step."""


def _put_on_ground(model: mujoco.MjModel, data: mujoco.MjData, plan: RobotPlan, geoms: list[int]) -> None:
    root = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, plan.prefix)
    lowest = lowest_point(model, data, geoms)
    if root >= 0 and lowest is not None:
        x, y, _ = plan.pose.translation.tolist()
        ground = ground_height(model, data, x, y)
        model.qpos0[model.jnt_qposadr[root] + 2] += ground - lowest - _PRESSED


_POSITIONS = {0: 7, 1: 4, 2: 1, 3: 1}
_SPEEDS = {0: 6, 1: 3, 2: 1, 3: 1}
"""How many positions and velocities a joint has, by MuJoCo's mjtJoint: free, ball, slide, hinge."""


def _carry_over(
    old: mujoco.MjModel, before: mujoco.MjData, new: mujoco.MjModel, after: mujoco.MjData, prefix: str = ""
) -> None:
    """Copy positions, velocities and servo states of everything that both models have.

    Only names that start with `prefix` are copied.
    """
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
