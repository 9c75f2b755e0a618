"""The engine's model of a simulation, as an MjModel and as MJCF text, for programs other than KBot."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief, brief, counted
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, NoDrive, SteeredDrive
from kbot.sim.engine.assembly import build_spec
from kbot.sim.simulation import Simulation
from kbot.text import DiagnosticCollector, KbotError

START = "start"
"""The name of the keyframe with the robot on its wheels at its start."""
_DIGITS, _DEFAULT_DIGITS = 17, 6
"""A double needs 17 digits. With MuJoCo's default of 6, a run differs after a few seconds."""


@dataclass(frozen=True, eq=False, repr=False)
class MujocoModel(Brief):
    """A robot in a world for MuJoCo.

    model      the compiled model, with KBot's contacts, time step and servos
    xml        the same model as MJCF text. It needs no other files
    actuators  the actuator of each driving wheel, by the name of its joint
    """

    model: mujoco.MjModel
    xml: str
    actuators: dict[str, int]
    _drive: DifferentialDrive | NoDrive = field(repr=False)

    def controls(self, linear: float, angular: float) -> NDArray[np.float64]:
        """The values (nu,) for `data.ctrl` that drive forward at `linear` m/s while turning at `angular`
        rad/s. Each is the speed of a wheel's joint in rad/s.

        Raises:
            KbotError: the robot has no differential or skid-steer drive.
        """
        drive = self._drive
        if isinstance(drive, NoDrive):
            raise KbotError(f"the robot cannot drive: {drive.reason}")
        if isinstance(drive, SteeredDrive | HolonomicDrive):
            raise KbotError(
                "only differential and skid-steer drives have constant controls: KBot's own controller"
                " computes those of steered wheels and holonomic bases from the state at each period"
            )
        values = np.zeros(self.model.nu)
        for joints, speed in zip((drive.left, drive.right), drive.wheel_speeds(linear, angular), strict=True):
            for joint in joints:
                values[self.actuators[joint]] = speed * drive.forward[joint]
        return values

    def start(self) -> mujoco.MjData:
        """New data with the robot at its start."""
        data = mujoco.MjData(self.model)
        mujoco.mj_resetDataKeyframe(self.model, data, self.model.key(START).id)
        return data

    def _shown(self) -> Iterator[str]:
        yield counted(self.model.nbody - 1, "body", "bodies")
        yield counted(self.model.nu, "actuator")
        yield f"wheels={brief(list(self.actuators))}"


def export(simulation: Simulation) -> MujocoModel:
    """The model of a simulation with one robot, which is reset. The robot's start is the keyframe `start`.

    Raises:
        KbotError: the simulation has several robots, or MuJoCo cannot write numbers with all digits.
    """
    if len(simulation.robots) > 1:
        raise KbotError("only a simulation with one robot can be exported")
    simulation.reset()
    engine, robot = simulation.engine, simulation.robots.first
    assembly, data, prefix = engine.assembly, engine.data, robot.body.prefix
    plans, findings = tuple(assembly.plans.values()), DiagnosticCollector()
    spec = build_spec(assembly.world, plans, assembly.timestep, (), findings)
    at = robot.body.root_qpos
    if at >= 0:
        # the engine's model is lifted onto the ground after it was compiled
        root = spec.body(prefix + robot.robot.root)
        root.pos, root.quat = data.qpos[at : at + 3], data.qpos[at + 3 : at + 7]
    spec.modelname = robot.name
    spec.add_key(name=START, qpos=data.qpos, qvel=data.qvel, act=data.act, ctrl=data.ctrl)
    spec.compile()
    with _all_digits():
        xml = spec.to_xml()
    model = mujoco.MjModel.from_xml_string(xml)
    drive, settings = robot.drive, robot.settings
    actuators: dict[str, int] = {}
    if isinstance(drive, DifferentialDrive):
        kind = mujoco.mjtObj.mjOBJ_ACTUATOR
        found = {joint: mujoco.mj_name2id(model, kind, prefix + joint) for joint in drive.joints}
        actuators = {joint: index for joint, index in found.items() if index >= 0}
        # with the sizes that the robot's own controller uses, right or wrong
        drive = drive if settings is None else settings.with_controller_sizes(drive)
    return MujocoModel(model, xml, actuators, drive)


@contextmanager
def _all_digits() -> Iterator[None]:
    """Let MuJoCo write numbers with all digits. Its library offers this, but not its Python bindings."""
    setter = None
    for file in Path(mujoco.__file__).parent.glob("*mujoco*"):
        if file.suffix in (".dll", ".dylib") or ".so" in file.suffixes[:1]:
            setter = getattr(ctypes.CDLL(str(file)), "_mjPRIVATE__set_xml_precision", None) or setter
    if setter is None:
        raise KbotError(
            f"MuJoCo {mujoco.__version__} cannot write numbers with all digits, so the model would move"
            " differently. Install another version of mujoco-core"
        )
    setter(_DIGITS)
    try:
        yield
    finally:
        setter(_DEFAULT_DIGITS)
