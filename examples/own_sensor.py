"""Write your own sensor: two light sensors with which the robot finds a lamp.

kbot sim kbot --world empty --script own_sensor.py

A sensor consists of a specification, which sets where it is mounted, and a class that measures. KBot calls
`measure` at the sensor's rate, and publishes the result on the topic of the sensor's name.
"""

from dataclasses import dataclass
from math import hypot
from typing import ClassVar

from kbot import Simulation, Transform
from kbot.messages import Float64
from kbot.sensors import Sensor, Spec

LAMP = (1.5, 1.0)  # m


@dataclass(frozen=True, kw_only=True)
class LightMeter(Spec):
    """Measures how bright the lamp is: 1 at a distance of 1 m, a quarter of that at 2 m."""

    kind: ClassVar[str] = "light"

    def mount(self, simulation: Simulation) -> "LightSensor":
        return LightSensor(simulation, self)


class LightSensor(Sensor[Float64]):
    message_type = Float64

    def measure(self, sample: int | None = None) -> Float64:
        _, _, position, _ = self._place()  # of the sensor in the world, in m
        distance = hypot(position[0] - LAMP[0], position[1] - LAMP[1])
        return Float64(1.0 / max(distance, 0.01) ** 2)


def at(x: float, y: float) -> Transform:
    return Transform.from_xyz_rpy((x, y, 0.0), (0.0, 0.0, 0.0))


def drive(sim: Simulation) -> None:
    sim.draw.points("lamp", [LAMP], "yellow", size=0.1)
    left, right = (
        sim.add_sensor(LightMeter(name=name, link="base_link", pose=at(0.06, y)))
        for name, y in (("light_left", 0.06), ("light_right", -0.06))
    )
    while left.measure().data < 50.0:  # about 14 cm from the lamp
        brighter = left.measure().data - right.measure().data
        both = left.measure().data + right.measure().data
        sim.cmd_vel(0.2, 10.0 * brighter / both)  # turn to the brighter side
        sim.run(0.05)
    sim.cmd_vel(0.0, 0.0)
    sim.run(0.5)
