"""Test that a robot drives straight, turns by the right angle, and has correct odometry.

    kbot sim robot.xacro --headless --script drive_straight.py --plot drive.png

A failed `assert` ends the run with exit status 1, and prints the time and the values.
"""

from math import degrees, hypot, pi

from kbot import Simulation


def drive(sim: Simulation) -> None:
    sim.cmd_vel(0.2, 0.0)
    sim.run(10.0)
    sim.cmd_vel(0.0, 0.0)
    sim.run(1.0)
    pose, before = sim.ground_truth.pose, sim.ground_truth.unwrapped_yaw
    assert abs(pose.x - 2.0) < 0.01, "drives two metres ahead"
    assert abs(pose.y) < 0.005, "drives straight"

    sim.cmd_vel(0.0, 1.0)
    sim.run(2 * pi)
    sim.cmd_vel(0.0, 0.0)
    sim.run(1.0)
    turned = degrees(sim.ground_truth.unwrapped_yaw - before)
    assert abs(turned - 360.0) < 1.0, "turns once around"

    odometry, truth = sim.odometry.pose, sim.ground_truth.pose
    off = hypot(odometry.x - truth.x, odometry.y - truth.y)
    assert off < 0.001, "odometry is correct to a millimetre"
