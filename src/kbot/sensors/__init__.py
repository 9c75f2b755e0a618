"""Simulated sensors: lidar, IMU, encoders and others, with noise and rates.

A spec declares a sensor, and `add_sensor` mounts it: `lidar = sim.add_sensor(Lidar(link="base_link"))`. From
then on the sensor measures at its rate. `lidar.latest` is the newest reading.
"""

from kbot.lazy_names import lazy_names, public_names
from kbot.sensors.camera import Camera, CameraSensor
from kbot.sensors.contact import Contact, ContactSensor
from kbot.sensors.encoders import Encoders, EncoderSensor
from kbot.sensors.force_torque import ForceTorque, ForceTorqueSensor
from kbot.sensors.imu import Imu, ImuSensor
from kbot.sensors.lidar import CloudSensor, Lidar, LidarSensor, scan_points
from kbot.sensors.line import Line, LineSensor
from kbot.sensors.noise import Noise
from kbot.sensors.position import Gps, GpsSensor, GroundTruth, GroundTruthSensor
from kbot.sensors.proximity import Range, RangeSensor
from kbot.sensors.sensor import Sensor, Spec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.sensors.declared import mount_declared

_HOMES = {
    "mount_declared": "declared",
}

__all__ = [
    "Camera",
    "CameraSensor",
    "CloudSensor",
    "Contact",
    "ContactSensor",
    "EncoderSensor",
    "Encoders",
    "ForceTorque",
    "ForceTorqueSensor",
    "Gps",
    "GpsSensor",
    "GroundTruth",
    "GroundTruthSensor",
    "Imu",
    "ImuSensor",
    "Lidar",
    "LidarSensor",
    "Line",
    "LineSensor",
    "Noise",
    "Range",
    "RangeSensor",
    "Sensor",
    "Spec",
    "mount_declared",
    "scan_points",
]

# imported on first use, for start-up time
__getattr__ = lazy_names(__name__, _HOMES)
__dir__ = public_names(__all__)
