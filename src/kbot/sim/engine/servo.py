"""The actuators of joints: speed servos for drive wheels, position servos for others, with torque limits.

A drive servo also holds the integral of the difference between the commanded and the actual speed. On a slope
of 10 degrees, a plain speed servo rolls down by 374 mm in a minute, this one by 0.01 mm. The gain depends on
the inertia that the wheel moves. As the hard velocity constraint of gz (JointVelocityCmd, limited by
`<effort>`), it overcomes the damping and the dry friction of the joint, within the joint's effort limit.

MuJoCo's own `intvelocity` servo holds the integral as a target angle. At a time step h and a stiffness kp,
its force limit then acts on a torque that is h kp w too high at the speed w: with 4 ms, a wheel of KBot
saturated above 0.6 m/s, without any load. With the integral as the servo's state, the limit acts on the
torque itself.
"""

from __future__ import annotations

import mujoco

from kbot.kinematics.bodies import total_mass
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, SteeredDrive
from kbot.kinematics.spatial import GRAVITY
from kbot.model import RobotModel
from kbot.sim.engine.joints import resistance
from kbot.sim.recipe import SERVO_MARGIN, SERVO_STIFFNESS, SERVO_TIME, Contacts

LEAST_GRIP = 0.05
"""Lowest coefficient of friction that a servo is sized for, so that a wheel on ice still turns."""
_DECAY = 1e8
"""Time constant in s with which the integral of a drive servo decays: on a slope, a robot rolls down by less
than 1e-9 m in a minute. MuJoCo computes 1 - exp(-h / T), which loses its digits if T is much larger."""
STEERING_ACCELERATION = 100.0
"""Acceleration in rad/s^2 of a steering joint that its effort limit must allow: 90 degrees take 0.3 s."""


def add_drive_servos(
    spec: mujoco.MjSpec,
    robot: RobotModel,
    drive: DifferentialDrive,
    prefix: str,
    contacts: Contacts,
    grip: float,
    torque: float | None,
) -> None:
    """Add a speed servo, with an inertia of its own, to every drive wheel. It is commanded in rad/s.

    Its torque limit is `SERVO_MARGIN` times what the tyre can hold at a coefficient of friction of `grip`,
    but at most the joint's effort limit and the drive's `torque` (N m). With contacts as written, these two
    limits alone apply, if there is one. What they leave compensates the joint's dry friction and damping.

    The servo's inertia is as large as that of the robot which the wheel moves. So a strong servo can exert
    half of its limit on a wheel that speeds up, and no tyre slips at a start, but all of it on a blocked
    wheel. A motor that is too weak to let the tyre slip exerts its whole torque, so it has less inertia. The
    wheels of a holonomic base do not push it, so their servos' inertia is what they have to move.
    """
    count = len(drive.joints)
    mass = total_mass(robot)
    for name in drive.joints:
        radius = drive.wheels[name].radius or drive.radius
        inertia = mass * radius * radius / count
        gain = inertia / SERVO_TIME
        damping, friction = resistance(robot.joints[name])
        traction = SERVO_MARGIN * max(grip, LEAST_GRIP) * mass * GRAVITY / count * radius
        allowed = min(robot.joints[name].effort_limit, torque or float("inf"))
        if contacts is Contacts.AS_WRITTEN and allowed < float("inf"):
            most = allowed
        elif traction + friction <= allowed:
            # the motor overcomes the friction: the servo would first have to wind up its spring against it
            most, allowed = traction, allowed - friction
            spec.joint(prefix + name).frictionloss = 0.0
        else:
            most = allowed
        share = 1.0 if isinstance(drive, HolonomicDrive) else min(max(2.0 * most / traction - 1.0, 0.0), 1.0)
        spec.joint(prefix + name).armature = share * inertia
        servo = spec.add_actuator(name=prefix + name, target=prefix + name)
        servo.trntype = mujoco.mjtTrn.mjTRN_JOINT
        _integrate_speed(servo, SERVO_STIFFNESS * gain, gain)
        servo.forcelimited = True
        servo.forcerange = (-most, most)
        if damping > 0.0 and allowed > most:
            _compensate(spec, prefix + name, damping, allowed - most)


def _integrate_speed(servo: mujoco.MjsActuator, stiffness: float, damping: float) -> None:
    """Let a servo exert `stiffness` times the integral of its speed error, less `damping` times its speed.

    The only state of MuJoCo's actuators that depends on speed is the current of a DC motor. With the motor
    constant 1, the resistance R, the electrical time constant T and a controller of gain k, MuJoCo computes
    di/dt = (k (command - speed) - i) / T (source: mjDYN_DCMOTOR in engine_forward.c). With k = T that is the
    integral, which decays with T. R has no effect on it, and is the gain from the state to the torque.
    """
    servo.dyntype = mujoco.mjtDyn.mjDYN_DCMOTOR
    servo.gaintype = mujoco.mjtGain.mjGAIN_FIXED
    servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    servo.ctrlspec = int(mujoco.mjtCtrlInput.mjINPUT_VEL)
    servo.actdim = 1
    servo.actearly = True  # MuJoCo requires it for this state
    servo.dynprm[0] = _DECAY
    servo.gainprm[0], servo.gainprm[1], servo.gainprm[6] = stiffness, 1.0, _DECAY
    servo.biasprm[2] = -damping


def _compensate(spec: mujoco.MjSpec, joint: str, damping: float, most: float) -> None:
    """Add an actuator that cancels a joint's damping with at most `most` N m.

    It acts besides the servo, because the servo's limit is one of what the tyre can hold: a blocked wheel has
    no damping to compensate, so it does not climb a wall either.
    """
    added = spec.add_actuator(name=f"{joint}:damping", target=joint)
    added.trntype = mujoco.mjtTrn.mjTRN_JOINT
    # its command stays 0: with a gain of 0, MuJoCo would take the damping for the damping ratio of a spring
    added.gainprm[0] = 1.0
    added.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    added.biasprm[2] = damping
    if most < float("inf"):
        added.forcelimited = True
        added.forcerange = (-most, most)


def add_joint_servos(spec: mujoco.MjSpec, robot: RobotModel, driven: tuple[str, ...], prefix: str) -> None:
    """Add a servo to every other joint that has a position. It exerts no force until it is commanded."""
    for joint in robot.movable_joints:
        if joint.name not in driven and joint.mimic is None:
            _add_position_servo(spec, prefix + joint.name, joint.effort_limit)


def add_steering_servos(spec: mujoco.MjSpec, robot: RobotModel, drive: SteeredDrive, prefix: str) -> None:
    """Add a position servo to every steering joint.

    Its motor's inertia makes it stiff enough for the forces of the tyre, and is so small that a weak motor
    still steers briskly. The servo overcomes the joint's dry friction, within the effort limit. Otherwise the
    joint would stop short of its target.
    """
    inertia = total_mass(robot) * drive.radius * drive.radius
    for name in drive.steering:
        effort, (_, friction) = robot.joints[name].effort_limit, resistance(robot.joints[name])
        spec.joint(prefix + name).armature = min(inertia, effort / STEERING_ACCELERATION)
        if friction < effort:
            spec.joint(prefix + name).frictionloss = 0.0
            effort -= friction
        _add_position_servo(spec, prefix + name, effort)


def _add_position_servo(spec: mujoco.MjSpec, joint: str, effort: float) -> None:
    servo = spec.add_actuator(name=joint, target=joint)
    servo.trntype = mujoco.mjtTrn.mjTRN_JOINT
    servo.set_to_position(kp=0.0, kv=0.0)
    if effort < float("inf"):
        servo.forcelimited = True
        servo.forcerange = (-effort, effort)
