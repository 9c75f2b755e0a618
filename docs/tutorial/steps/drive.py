"""Drive round a square with sides of 1 m."""

from math import pi

from kbot import Simulation


def drive(sim: Simulation) -> None:
    for _ in range(4):
        go(sim, 0.25, 0.0, 4.0)  # 0.25 m/s for 4 s: 1 m
        go(sim, 0.0, pi / 4, 2.0)  # pi/4 rad/s for 2 s: a quarter turn to the left


def go(sim: Simulation, speed: float, turn: float, seconds: float) -> None:
    sim.cmd_vel(speed, turn)
    sim.run(seconds)
    sim.cmd_vel(0.0, 0.0)
    sim.run(0.5)  # until it stops
