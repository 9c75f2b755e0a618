"""Everything that exists because of ROS. The core does not import it."""

from kbot.lazy_names import lazy_names, public_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.ros.client.node import Node
    from kbot.ros.client.pilot import NodePilot

__all__ = ["Node", "NodePilot"]

# imported on first use, for start-up time
__getattr__ = lazy_names(__name__, {"Node": "client.node", "NodePilot": "client.pilot"})
__dir__ = public_names(__all__)
