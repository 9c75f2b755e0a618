"""Replaces the nodes of the challenge's gazebo_launch.launch, while the simulation runs in real time.

- collision_publisher: reports on `/collision` that the robot touches anything but the ground.
- robot_localization, as the Jackal configures it: the heading is the IMU's orientation, and the distance is
  that of the wheels. It publishes where the wheels' frame of odometry is in `odom`, which therefore has the
  world's axes. The challenge's goal is in `odom`.
"""

from kbot.kinematics import PlanarPose
from kbot.messages import Odometry
from kbot.messages.sensing import Bool, Imu
from kbot.messages.types import Header, Quaternion, TFMessage, Transform, TransformStamped, Vector3
from kbot.sim import Simulation
from kbot.sim.real_time import run_in_real_time

ODOMETRY, IMU, FRAME = "jackal_velocity_controller/odom", "imu/data", "odom"


class Localization:
    def __init__(self, sim: Simulation) -> None:
        self._yaw = 0.0
        self._pose = PlanarPose()
        self._wheels = PlanarPose()
        self._publisher = sim.bus.advertise("/tf", TFMessage)
        sim.bus.subscribe(IMU, Imu, self._turn)
        sim.bus.subscribe(ODOMETRY, Odometry, self._move)

    def _turn(self, imu: Imu) -> None:
        self._yaw = imu.orientation.yaw

    def _move(self, odometry: Odometry) -> None:
        pose = odometry.pose.pose
        wheels = PlanarPose(pose.position.x, pose.position.y, pose.orientation.yaw)
        way = self._wheels.inverse() @ wheels
        moved = PlanarPose(self._pose.x, self._pose.y, self._yaw) @ PlanarPose(way.x, way.y)
        self._wheels, self._pose = wheels, moved
        at = moved @ wheels.inverse()
        transform = Transform(Vector3(at.x, at.y, 0.0), Quaternion.about_z(at.yaw))
        header = Header(odometry.header.stamp, FRAME)
        self._publisher.publish(TFMessage((TransformStamped(header, odometry.header.frame_id, transform),)))


def drive(sim: Simulation) -> None:
    Localization(sim)
    collision = sim.bus.advertise("collision", Bool)

    def look() -> None:
        if sim.collided:
            collision.publish(Bool(True))

    sim.clock.every(20.0, look)
    run_in_real_time(sim, None)
