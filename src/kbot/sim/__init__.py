"""The simulation of robots in a world, with MuJoCo."""

from kbot.sim.divergence import SimulationDiverged
from kbot.sim.drive.twist_controller import DriveLimits
from kbot.sim.recipe import Contacts
from kbot.sim.simulation import Simulation
from kbot.sim.snapshots import Snapshot
from kbot.sim.wheel_odometry import Motion

__all__ = ["Contacts", "DriveLimits", "Motion", "Simulation", "SimulationDiverged", "Snapshot"]
