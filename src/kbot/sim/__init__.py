"""The simulation of robots in a world, with MuJoCo."""

from kbot.lazy_names import lazy_names, public_names
from kbot.sim.divergence import SimulationDiverged
from kbot.sim.drive.twist_controller import DriveLimits
from kbot.sim.recipe import Contacts
from kbot.sim.simulation import Simulation
from kbot.sim.snapshots import Snapshot
from kbot.sim.wheel_odometry import Motion

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.sim.injected_faults import BlockedJoint, Kick, LostCommands, Payload, SilentTopic, Slip

_HOMES = {
    "BlockedJoint": "injected_faults",
    "Kick": "injected_faults",
    "LostCommands": "injected_faults",
    "Payload": "injected_faults",
    "SilentTopic": "injected_faults",
    "Slip": "injected_faults",
}

__all__ = [
    "BlockedJoint",
    "Contacts",
    "DriveLimits",
    "Kick",
    "LostCommands",
    "Motion",
    "Payload",
    "SilentTopic",
    "Simulation",
    "SimulationDiverged",
    "Slip",
    "Snapshot",
]

# imported on first use, for start-up time
__getattr__ = lazy_names(__name__, _HOMES)
__dir__ = public_names(__all__)
