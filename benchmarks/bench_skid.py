"""How far skid-steer robots turn in KBot, compared with Coulomb's law of friction and with DART.

    python -m pip install -e .[bench]
    python benchmarks/bench_skid.py [--from FOLDER] [NAME…]

The skid-steer robots of `robots.tsv` are commanded to turn at 0.5 rad/s for 5 s. Each column is the angle as
a share of the command, with the start from standstill. "Multiplier" is the speed of the wheels as a share of
that with the true sizes: controllers of such robots declare a larger wheel separation. "Coulomb" is the
steady rate at which the friction on all wheels is in balance, with the description's coefficients and the
wheels' loads at rest. DART gets the same wheel speeds, spheres as wheels, and the same coefficients: first
with its exact solver for Coulomb's law, then with its default boxed LCP, as in Gazebo, at headings of 0 and
45 degrees. The boxed LCP limits the friction along two axes of the world independently, so its result depends
on the heading. DART's Python package has no friction by direction. The wheels of a robot with four rigid
wheels carry arbitrary shares of its load in DART. In KBot they carry those of equally soft wheels.
Exit status 1 if KBot and Coulomb's law differ by more than 10 % for a robot.
"""

from __future__ import annotations

import math
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import dartpy as dart
import mujoco
import numpy as np
from bench_robots import Robot, read_robots
from numpy.typing import NDArray
from public_repositories import chosen_by_user, fetch

from kbot.kinematics.drive.drive import DifferentialDrive
from kbot.kinematics.frames import FrameTree
from kbot.model import RobotModel
from kbot.model.load import load_robot
from kbot.model.writer import to_urdf
from kbot.sim import Simulation
from kbot.xacro import Packages

RATE, SECONDS = 0.5, 5.0
PERIOD = 0.01
"""Seconds between two wheel speeds."""
STEP = 0.001
ALLOWED = 0.1
GRIPPING = 1000.0
"""Friction of DART's ground: the lower coefficient of two surfaces applies."""

Speeds = list[dict[str, float]]


def main() -> int:
    robots, folder = chosen_by_user(__doc__, [robot for robot in read_robots() if robot.drive == "skid"])
    print("| robot | multiplier | KBot | Coulomb | DART, Coulomb | DART, boxed, 0° | DART, boxed, 45° |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    differ = []
    for robot in robots:
        with tempfile.TemporaryDirectory() as scratch:
            shares = list(_shares(_load(robot, Path(scratch), folder)))
        cells = " | ".join("" if share is None else f"{share:.2f}" for share in shares)
        print(f"| {robot.name} | {cells} |", flush=True)
        own, law = shares[1], shares[2]
        if own is None or law is None or abs(own - law) > ALLOWED * abs(law):
            differ.append(robot.name)
    print(f"\nKBot and Coulomb's law differ by more than {ALLOWED:.0%}: {', '.join(differ) or 'none'}.")
    return int(bool(differ))


def _load(entry: Robot, scratch: Path, folder: Path | None) -> RobotModel:
    for source in (entry.source, *entry.packages):
        if not (scratch / source.folder).exists():
            fetch(source, scratch, folder)
    arguments = dict(word.split(":=", 1) for word in entry.arguments)
    packages = Packages([str(scratch / source.folder) for source in entry.packages])
    return load_robot(scratch / entry.source.folder / entry.file, arguments, packages=packages).require()


def _shares(robot: RobotModel) -> Iterator[float | None]:
    """The cells of a robot's row."""
    simulation = Simulation(robot)
    driven = simulation.robots.first
    assert isinstance(driven.drive, DifferentialDrive)
    simulation.run(0.5)
    loads, frictions = _contacts(simulation, driven.drive)
    simulation.reset()
    model, data = simulation.engine.model, simulation.engine.data
    servos = {joint: model.actuator(f"{driven.name}/{joint}").id for joint in driven.drive.joints}
    speeds: Speeds = []
    angles = [0.0]
    for _ in range(round(SECONDS / PERIOD)):
        simulation.cmd_vel(0.0, RATE)
        simulation.run(PERIOD)
        speeds.append({joint: float(data.ctrl[servo]) for joint, servo in servos.items()})
        angles.append(simulation.ground_truth.pose.yaw)
    final = speeds[-1]
    declared = max(abs(speed) for speed in final.values()) * driven.drive.radius
    yield 2.0 * declared / (RATE * driven.drive.separation)
    yield float(np.unwrap(angles)[-1]) / (RATE * SECONDS)
    yield _balance(driven.drive, loads, frictions, final) / RATE
    for heading, is_exact in ((0.0, True), (0.0, False), (math.pi / 4.0, False)):
        # DART's Python package cannot set friction by direction, and gets no casters
        fits = len(driven.drive.left) > 1 and all(across == along for across, along in frictions.values())
        yield _in_dart(driven.drive, robot, frictions, speeds, heading, is_exact) if fits else None


def _contacts(
    simulation: Simulation, drive: DifferentialDrive
) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """The load in N of each wheel's joint, and its coefficients of friction across and along the wheel."""
    model, data = simulation.engine.model, simulation.engine.data
    links = {wheel.link: joint for joint, wheel in drive.wheels.items()}
    loads, frictions = dict.fromkeys(drive.joints, 0.0), {}
    force = np.zeros(6)
    for pair in range(model.npair):
        joint = links[model.body(int(model.geom_bodyid[model.pair_geom2[pair]])).name.partition("/")[2]]
        frictions[joint] = tuple(model.pair_friction[pair, :2].tolist())
    for index, contact in enumerate(data.contact):
        link = model.body(int(model.geom_bodyid[contact.geom[1]])).name.partition("/")[2]
        if link in links:
            mujoco.mj_contactForce(model, data, index, force)
            loads[links[link]] += float(force[0])
            # a robot that drives one axle has no such pairs
            frictions.setdefault(links[link], tuple(contact.friction[:2].tolist()))
    return loads, frictions


def _balance(
    drive: DifferentialDrive,
    loads: dict[str, float],
    frictions: dict[str, tuple[float, float]],
    speeds: dict[str, float],
) -> float:
    """The turning rate in rad/s at which friction is in balance.

    The friction that dissipates most opposes the slip, so at this motion the sum over all wheels of the load
    times the slip, weighted by the coefficients, has its minimum. It is convex, and found by reweighted least
    squares (Weiszfeld's method), smoothed less and less.
    """
    axle_from_base = drive.axle_in_base.inverse()
    rows, rims, weights = [], [], []
    for joint in drive.joints:
        x, y, _ = axle_from_base.apply(drive.wheels[joint].center).tolist()
        across, along = frictions[joint]
        rows.append([[along, 0.0, -along * y], [0.0, across, across * x]])
        rims.append([along * speeds[joint] * drive.forward[joint] * drive.radius, 0.0])
        weights.append(loads[joint])
    jacobian, rim, load = np.array(rows), np.array(rims), np.array(weights)
    motion = np.zeros(3)
    for smooth in np.repeat([1e-1, 1e-2, 1e-3, 1e-4, 1e-5], 60):
        slip = jacobian @ motion - rim
        weight = load / np.sqrt((slip**2).sum(axis=1) + smooth**2)
        normal = np.einsum("i,ijk,ijl->kl", weight, jacobian, jacobian)
        motion = np.linalg.solve(normal, np.einsum("i,ijk,ij->k", weight, jacobian, rim))
    return float(motion[2])


def _in_dart(
    drive: DifferentialDrive,
    robot: RobotModel,
    frictions: dict[str, tuple[float, float]],
    speeds: Speeds,
    heading: float,
    is_exact: bool,
) -> float:
    """The angle by which the robot turns in DART, as a share of the command."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.urdf"
        file.write_bytes(_wheels_only(drive, robot))
        body = dart.utils.DartLoader().parseSkeleton(str(file))
    for joint in drive.joints:
        wheel = body.getBodyNode(drive.wheels[joint].link)
        shapes = [wheel.getShapeNode(index) for index in range(wheel.getNumShapeNodes())]
        shapes[0].getDynamicsAspect().setFrictionCoeff(min(frictions[joint]))
    world = dart.simulation.World()
    world.setTimeStep(STEP)
    world.setGravity([0.0, 0.0, -9.81])
    solver = world.getConstraintSolver()
    solver.setCollisionDetector(dart.collision.OdeCollisionDetector())
    if is_exact:
        options = dart.constraint.NsgsFrictionSolver.Options()
        options.law = dart.constraint.NsgsFrictionSolver.Law.Coulomb
        options.maxSweeps = 200
        solver.setBoxedLcpSolver(dart.constraint.NsgsFrictionSolver(options))
    world.addSkeleton(_ground())
    world.addSkeleton(body)
    for joint in (body.getJoint(index) for index in range(1, body.getNumJoints())):
        drives = joint.getName() in drive.joints
        kinds = dart.dynamics.ActuatorType
        joint.setActuatorType(kinds.VELOCITY if drives else kinds.LOCKED)
    base = FrameTree(robot).pose(drive.base, in_frame=robot.root)
    lowest = min(base.apply(w.center)[2] - (w.radius or drive.radius) for w in drive.wheels.values())
    positions = body.getPositions()
    positions[2], positions[5] = heading, -lowest
    body.setPositions(positions)
    angles = [heading]
    for wanted in speeds:
        for name, speed in wanted.items():
            body.getJoint(name).setCommand(0, speed)
        for _ in range(round(PERIOD / STEP)):
            world.step(False)  # False: keep the command
        rotation = body.getRootBodyNode().getWorldTransform().rotation()
        angles.append(math.atan2(rotation[1, 0], rotation[0, 0]))
    unwrapped: NDArray[np.float64] = np.unwrap(angles)
    return float(unwrapped[-1] - heading) / (RATE * SECONDS)


def _ground() -> Any:  # noqa: ANN401 - DART has no types
    ground = dart.dynamics.Skeleton("ground")
    _, body = ground.createWeldJointAndBodyNodePair()
    shape = body.createShapeNode(dart.dynamics.BoxShape([100.0, 100.0, 0.2]))
    shape.createCollisionAspect()
    shape.createDynamicsAspect()
    shape.getDynamicsAspect().setFrictionCoeff(GRIPPING)
    shape.setRelativeTranslation([0.0, 0.0, -0.1])
    return ground


def _wheels_only(drive: DifferentialDrive, robot: RobotModel) -> bytes:
    """The robot's URDF with spheres as wheels, and without other shapes."""
    urdf = ET.fromstring(to_urdf(replace(robot, extensions=())))
    wheels = {wheel.link: wheel for wheel in drive.wheels.values()}
    tree = FrameTree(robot)
    for link in urdf.findall("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            link.remove(shape)
        wheel = wheels.get(link.get("name", ""))
        if wheel is not None:
            x, y, z = tree.pose(drive.base, in_frame=wheel.link).apply(wheel.center).tolist()
            collision = ET.SubElement(link, "collision")
            ET.SubElement(collision, "origin", xyz=f"{x} {y} {z}")
            geometry = ET.SubElement(collision, "geometry")
            ET.SubElement(geometry, "sphere", radius=str(wheel.radius or drive.radius))
    for joint in urdf.findall("joint"):
        for dynamics in joint.findall("dynamics"):  # the wheels are moved at the given speeds
            joint.remove(dynamics)
    return ET.tostring(urdf)


if __name__ == "__main__":
    sys.exit(main())
