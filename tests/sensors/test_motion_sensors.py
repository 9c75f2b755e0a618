"""IMU, encoders, GPS and ground truth against theory."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose, Transform
from kbot.sensors import Encoders, Gps, GroundTruth, Imu, Noise
from kbot.sensors.position import geodetic
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world import load_world
from kbot.world.builders import floor
from kbot.world.world import World

G = 9.81


def _vector(v):
    return np.array([v.x, v.y, v.z])


def _collect(simulation, sensor, seconds):
    received = []
    simulation.bus.subscribe(sensor.spec.topic or sensor.spec.label, sensor.message_type, received.append)
    simulation.run(seconds)
    return received


def test_imu_at_rest_on_a_slope_measures_gravity(robot):
    angle = math.radians(10)
    # a slope is simulated as a level floor with tilted gravity
    gravity = (-G * math.sin(angle), 0.0, -G * math.cos(angle))
    simulation = Simulation(robot, World("slope", (floor(),), gravity))
    imu = simulation.add_sensor(Imu(link="base_link"))
    simulation.run(0.5)
    received = _collect(simulation, imu, 0.2)
    force = np.mean([_vector(m.linear_acceleration) for m in received], axis=0)
    assert force == pytest.approx((G * math.sin(angle), 0.0, G * math.cos(angle)), abs=2e-3)
    assert np.abs([_vector(m.angular_velocity) for m in received]).max() < 2e-3


def test_tilted_imu_measures_in_its_own_axes(robot):
    simulation = Simulation(robot)
    pose = Transform.from_xyz_rpy((0, 0, 0), (math.pi / 2, 0.0, 0.0))
    imu = simulation.add_sensor(Imu(link="base_link", pose=pose))
    simulation.run(0.3)
    # its y points up
    assert _vector(imu.latest.linear_acceleration) == pytest.approx((0.0, G, 0.0), abs=2e-3)
    q = imu.latest.orientation
    assert (q.x, q.y, q.z, q.w) == pytest.approx((math.sqrt(0.5), 0, 0, math.sqrt(0.5)), abs=1e-4)


def test_imu_measures_centripetal_acceleration_on_a_circle(robot):
    v, w = 0.3, 1.2
    simulation = Simulation(robot)
    off = Transform.from_xyz_rpy((0.03, 0.05, 0.0), (0.0, 0.0, 0.0))
    imu = simulation.add_sensor(Imu(link="base_footprint", pose=off))
    simulation.cmd_vel(v, w)
    simulation.run(1.5)
    received = _collect(simulation, imu, 1.0)
    force = np.mean([_vector(m.linear_acceleration) for m in received], axis=0)
    # w^2 times the vector to the centre of the circle, which is v / w to the left
    assert force == pytest.approx((-(w**2) * 0.03, w**2 * (v / w - 0.05), G), abs=5e-3)
    spin = np.mean([m.angular_velocity.z for m in received])
    assert spin == pytest.approx(w, abs=1e-3)


def test_imu_measures_acceleration(robot):
    simulation = Simulation(robot)
    imu = simulation.add_sensor(Imu(link="base_footprint"))
    simulation.run(0.2)
    simulation.cmd_vel(0.5, 0.0)
    received = _collect(simulation, imu, 0.4)
    # the acceleration limit is 1 m/s^2
    assert np.mean([m.linear_acceleration.x for m in received[5:]]) == pytest.approx(1.0, abs=0.02)


def test_imu_noise_has_the_given_deviation_and_covariance(robot):
    simulation = Simulation(robot, seed=5)
    spec = Imu(
        link="base_link",
        rate=500.0,
        gyroscope=Noise(stddev=0.02),
        accelerometer=Noise(stddev=0.3, bias_mean=1.0),
    )
    imu = simulation.add_sensor(spec)
    simulation.run(0.3)
    received = _collect(simulation, imu, 2.0)
    force = np.array([_vector(m.linear_acceleration) for m in received])
    spin = np.array([_vector(m.angular_velocity) for m in received])
    n = len(received)
    assert force.mean(axis=0) == pytest.approx((1.0, 1.0, G + 1.0), abs=4 * 0.3 / math.sqrt(n) + 2e-3)
    assert force.std(axis=0) == pytest.approx([0.3] * 3, rel=4 / math.sqrt(2 * n))
    assert spin.std(axis=0) == pytest.approx([0.02] * 3, rel=4 / math.sqrt(2 * n) + 0.01)
    assert received[0].linear_acceleration_covariance[4] == pytest.approx(0.09)
    assert received[0].angular_velocity_covariance[8] == pytest.approx(0.0004)


def test_encoders_count_a_known_path(robot):
    simulation = Simulation(robot)
    encoders = simulation.add_sensor(Encoders(resolution=1000))
    simulation.cmd_vel(0.35, 0.0)
    simulation.run(3.0)
    count = 2 * math.pi / 1000
    way = simulation.ground_truth.pose.x
    for joint, position in zip(encoders.latest.name, encoders.latest.position, strict=True):
        assert (position / count) == pytest.approx(round(position / count), abs=1e-6)
        # the radius is 0.035 m; allow for one count and for the wheel's penetration
        assert position == pytest.approx(way / 0.035, abs=count + 0.01)
        assert joint in ("left_wheel_joint", "right_wheel_joint")
    # 10 rad/s, measured by whole counts in 20 ms
    assert encoders.latest.velocity == pytest.approx((10.0, 10.0), abs=count / 0.02 + 0.01)


def test_encoders_reject_an_unknown_joint(robot):
    with pytest.raises(KbotError, match="left_wheel_joint"):
        Simulation(robot).add_sensor(Encoders(joints=("left_wheel_jont",)))


@pytest.mark.parametrize("latitude", [0.0, 47.3769, -60.0, 89.9])
def test_geodetic_follows_the_curvature_of_the_earth(latitude):
    # metres per degree from the ellipsoid's radii of curvature
    a, f = 6378137.0, 1 / 298.257223563
    e2 = f * (2 - f)
    s = math.sin(math.radians(latitude))
    across = a / math.sqrt(1 - e2 * s * s)
    along = a * (1 - e2) / (1 - e2 * s * s) ** 1.5
    lat, lon, alt = geodetic([0.0, 10.0, 0.0], latitude, 8.5, 400.0)
    assert math.radians(lat - latitude) * (along + 400.0) == pytest.approx(10.0, abs=1e-4)
    lat, lon, _ = geodetic([10.0, 0.0, 0.0], latitude, 8.5, 400.0)
    east = math.radians(lon - 8.5) * (across + 400.0) * math.cos(math.radians(latitude))
    assert east == pytest.approx(10.0, abs=1e-4)
    assert geodetic([0.0, 0.0, 7.0], latitude, 8.5, 400.0) == pytest.approx((latitude, 8.5, 407.0), abs=1e-6)
    assert alt == pytest.approx(400.0, abs=1e-4)


def test_gps_measures_the_robots_position(robot):
    simulation = Simulation(robot)
    gps = simulation.add_sensor(
        Gps(link="base_footprint", latitude=47.0, longitude=8.0, horizontal=Noise(2.0))
    )
    simulation.models.place(PlanarPose(5.0, 3.0))
    fix = gps.measure()
    east = math.radians(fix.longitude - 8.0) * 6.39e6 * math.cos(math.radians(47.0))
    assert east == pytest.approx(5.0, rel=2e-3)
    assert fix.position_covariance[0] == 4.0
    with pytest.raises(KbotError, match="latitude must be from -90 to 90"):
        Gps(link="base_footprint", latitude=91.0)


def test_ground_truth_equals_that_of_the_simulation(robot):
    simulation = Simulation(robot)
    truth = simulation.add_sensor(GroundTruth(link="base_footprint"))
    simulation.cmd_vel(0.2, 0.5)
    simulation.run(2.0)
    motion, reported = simulation.ground_truth, truth.measure()
    assert (reported.pose.pose.position.x, reported.pose.pose.position.y) == (motion.pose.x, motion.pose.y)
    assert reported.twist.twist.angular.z == pytest.approx(0.5, abs=1e-3)
    assert reported.twist.twist.linear.x == pytest.approx(0.2, abs=1e-3)
    assert reported.header.frame_id == "world"


SDF = """<sdf version="1.9"><world name="w"><spherical_coordinates>
<surface_model>EARTH_WGS84</surface_model><world_frame_orientation>ENU</world_frame_orientation>
<latitude_deg>47.4</latitude_deg><longitude_deg>8.5</longitude_deg><elevation>400</elevation>
<heading_deg>{heading}</heading_deg></spherical_coordinates>
<model name="floor"><static>1</static><link name="l"><collision name="c"><geometry>
<plane><normal>0 0 1</normal>
<size>50 50</size></plane></geometry></collision></link></model></world></sdf>"""


@pytest.mark.parametrize(("heading", "east", "north"), [(0, 20.0, 0.0), (90, 0.0, -20.0), (-90, 0.0, 20.0)])
def test_gps_uses_the_georeference_of_the_world(robot, tmp_path, heading, east, north):
    """The robot is 20 m along the world's x. A metre is 1 / (N cos phi) rad to the east, 1 / M rad north.

    N and M are the radii of curvature of WGS 84 at 47.4 degrees.
    """
    (tmp_path / "w.sdf").write_text(SDF.format(heading=heading))
    simulation = Simulation(robot, str(tmp_path / "w.sdf"))
    gps = simulation.add_sensor(Gps(link="base_footprint"))
    simulation.models.set_pose(20.0, 0.0, 0.0)
    fix, phi, e2 = gps.measure(), math.radians(47.4), 0.00669437999
    n = 6378137.0 / math.sqrt(1.0 - e2 * math.sin(phi) ** 2)
    m = 6378137.0 * (1.0 - e2) / (1.0 - e2 * math.sin(phi) ** 2) ** 1.5
    assert fix.longitude == pytest.approx(8.5 + math.degrees(east / ((n + 400.0) * math.cos(phi))), abs=1e-9)
    assert fix.latitude == pytest.approx(47.4 + math.degrees(north / (m + 400.0)), abs=1e-9)
    assert fix.altitude == pytest.approx(400.0, abs=0.01)
    # a position given to the sensor takes precedence
    own = simulation.add_sensor(Gps(link="base_footprint", name="own", latitude=1.0, longitude=2.0))
    assert own.measure().latitude == pytest.approx(1.0, abs=1e-3)


def test_invalid_latitude_is_reported_and_the_georeference_ignored(tmp_path):
    (tmp_path / "w.sdf").write_text(SDF.format(heading=0).replace("47.4", "97.4"))
    world = load_world(tmp_path / "w.sdf")
    assert world.georeference is None
    (finding,) = world.diagnostics
    assert (finding.code, finding.severity) == ("W204", "warning")
    assert "longitude from -180 to 180 degrees, not 97.4" in finding.message
