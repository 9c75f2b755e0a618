"""Goals of simulated bases that steer, drive sideways, carry a load or have arms."""

import math
from dataclasses import replace

import pytest

from kbot.kinematics import PlanarPose
from kbot.model.load import load_robot_text
from kbot.navigation import ControllerLimits, NavigatorSettings, go_to, go_to_without_map
from kbot.navigation.simulated.mobility import BaseKind, mobility
from kbot.navigation.simulated.shape import loads, simulated_shape
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world import World
from kbot.world.builders import box, floor

INERTIA = '<inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/>'


def _box(size, x=0.0, z=0.0):
    return f'<collision><origin xyz="{x} 0 {z}"/><geometry><box size="{size}"/></geometry></collision>'


def _wheel(name, parent, x, y):
    return (
        f'<link name="{name}"><inertial><mass value="0.3"/>{INERTIA}</inertial><collision>'
        f'<origin rpy="1.5708 0 0"/><geometry><cylinder radius="0.05" length="0.03"/></geometry></collision>'
        f'</link><joint name="{name}_joint" type="continuous"><parent link="{parent}"/><child link="{name}"/>'
        f'<origin xyz="{x} {y} 0.05"/><axis xyz="0 1 0"/></joint>'
    )


def _steered_wheel(name, x, y):
    fork = f'<link name="{name}_fork"><inertial><mass value="0.2"/>{INERTIA}</inertial></link>'
    joint = (
        f'<joint name="{name}_steering" type="revolute"><parent link="base"/><child link="{name}_fork"/>'
        f'<origin xyz="{x} {y} 0"/><axis xyz="0 0 1"/>'
        '<limit lower="-0.6" upper="0.6" effort="20" velocity="3"/></joint>'
    )
    return fork + joint + _wheel(name, f"{name}_fork", 0.0, 0.0)


BODY = f'<link name="base"><inertial><origin xyz="0.1 0 0.06"/><mass value="5"/>{INERTIA}</inertial>'
CAR = (
    f'<robot name="car">{BODY}{_box("0.45 0.2 0.1", 0.13, 0.1)}</link>'
    f"{_wheel('left', 'base', 0, 0.12)}{_wheel('right', 'base', 0, -0.12)}"
    f"{_steered_wheel('front_left', 0.26, 0.12)}{_steered_wheel('front_right', 0.26, -0.12)}"
    '<gazebo><plugin filename="gz-sim-ackermann-steering-system" name="gz::sim::systems::AckermannSteering">'
    "<left_joint>left_joint</left_joint><right_joint>right_joint</right_joint>"
    "<left_steering_joint>front_left_steering</left_steering_joint>"
    "<right_steering_joint>front_right_steering</right_steering_joint></plugin></gazebo></robot>"
)
SIDEWAYS = (
    f'<robot name="omni">{BODY.replace("0.1 0 0.06", "0 0 0.06")}{_box("0.6 0.24 0.1", 0, 0.1)}</link>'
    + "".join(
        _wheel(name, "base", x, y)
        for name, x, y in (("a", 0.2, 0.1), ("b", 0.2, -0.1), ("c", -0.2, 0.1), ("d", -0.2, -0.1))
    )
    + '<gazebo><plugin filename="libgazebo_ros_planar_move.so" name="drive"/></gazebo></robot>'
)
ARM = (
    f'<link name="arm"><inertial><mass value="0.1"/>{INERTIA}</inertial>'
    f"{_box('0.5 0.04 0.04', 0.25, 0)}</link>"
    '<joint name="arm_joint" type="revolute"><parent link="base"/><child link="arm"/>'
    '<origin xyz="0 0 0.2"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="50" velocity="3"/></joint>'
)


def _with_lidar(text, fov=2.0 * math.pi):
    lidar = (
        '<gazebo reference="base"><sensor name="lidar" type="ray"><update_rate>20</update_rate>'
        "<pose>0.1 0 0.18 0 0 0</pose><ray><scan><horizontal><samples>360</samples>"
        f"<min_angle>{-fov / 2}</min_angle><max_angle>{fov / 2}</max_angle></horizontal></scan>"
        "<range><min>0.05</min><max>8</max></range></ray></sensor></gazebo>"
    )
    return text.replace("</robot>", f"{lidar}</robot>")


def _robot(text):
    return load_robot_text(text, "r.urdf").require()


def test_the_base_of_a_car_is_its_rear_axle_with_its_least_radius():
    moves = mobility(Simulation(_robot(CAR)))
    assert moves.kind is BaseKind.STEERS
    assert (moves.point.x, moves.point.y) == pytest.approx((0.0, 0.0), abs=1e-6)
    # the inner wheel is at its limit: the wheelbase over its tangent, and half the track
    assert moves.steering.radius == pytest.approx(0.26 / math.tan(0.6) + 0.12, rel=0.02)


@pytest.mark.parametrize(
    "goal", [PlanarPose(1.5, 0.8, 1.0), PlanarPose(0.0, 0.6, 0.0), PlanarPose(-0.8, 0.0, 3.0)]
)
def test_a_car_reaches_goals_that_need_cusps(goal):
    trip = go_to(Simulation(_robot(CAR)), goal)
    assert trip.reached, trip.status
    assert not trip.collided
    assert trip.off <= 0.011
    assert trip.turned_off <= 0.022
    assert trip.distance < 1.2 * trip.shortest + 0.1


def test_a_car_stops_at_a_place_whose_heading_is_free():
    settings = NavigatorSettings(limits=ControllerLimits(angle=math.pi))
    trip = go_to(Simulation(_robot(CAR)), PlanarPose(1.0, 0.0, 2.0), settings=settings)
    assert trip.reached
    assert trip.distance == pytest.approx(1.0, abs=0.02)


def test_a_base_that_drives_sideways_passes_a_gap_that_its_turning_circle_does_not():
    """The base is 0.6 m x 0.24 m. The gap is 0.4 m wide, and the goal's heading is along the wall."""
    wall = [box("left", (0.1, 1.8, 0.3), 1.0, 1.1), box("right", (0.1, 1.8, 0.3), 1.0, -1.1)]
    simulation = Simulation(_robot(SIDEWAYS), World("gap", (floor(), *wall)))
    assert mobility(simulation).kind is BaseKind.SIDEWAYS
    trip = go_to(simulation, PlanarPose(1.8, 0.0, math.pi / 2))
    assert trip.reached, trip.status
    assert not trip.collided
    assert trip.distance < 2.1


def test_a_base_that_drives_sideways_keeps_its_heading():
    simulation = Simulation(_robot(SIDEWAYS))
    trip = go_to(simulation, PlanarPose(0.0, 1.0, 0.0))
    assert trip.reached
    assert trip.distance == pytest.approx(1.0, abs=0.03)
    assert abs(simulation.ground_truth.pose.yaw) < 0.02


def test_a_load_is_part_of_the_outline_and_not_of_the_map():
    board = replace(box("board", (0.1, 0.8, 0.05), 0.0, 0.0, 0.3), mass=0.2)
    simulation = Simulation(_robot(SIDEWAYS), World("load", (floor(), board)))
    simulation.run(0.3)
    alone = simulated_shape(simulation)
    assert alone.outline.corners[:, 1].max() == pytest.approx(0.12, abs=0.01)
    assert not loads(simulation)
    simulation.models.attach("base", "board")
    assert len(loads(simulation)) == 1
    carrying = simulated_shape(simulation)
    assert carrying.outline.corners[:, 1].max() == pytest.approx(0.4, abs=0.02)
    trip = go_to(simulation, PlanarPose(1.0, 0.0, 0.0))
    assert trip.reached, trip.status


def test_a_lidar_that_detects_the_load_of_its_robot_does_not_stop_it():
    pole = replace(box("pole", (0.05, 0.05, 0.4), 0.25, 0.0, 0.36), mass=0.1)
    simulation = Simulation(_robot(_with_lidar(CAR)), World("load", (floor(), pole)))
    simulation.models.attach("base", "pole")
    trip = go_to_without_map(
        simulation, PlanarPose(1.5, 0.0), any_heading=True, arrive=0.1, max_speed=(0.5, 1.0)
    )
    assert trip.reached, trip.status


def test_an_arm_that_reaches_out_is_part_of_the_outline():
    simulation = Simulation(_robot(SIDEWAYS.replace("<gazebo>", f"{ARM}<gazebo>")))
    front = simulated_shape(simulation).outline.corners
    assert front[:, 0].max() == pytest.approx(0.5, abs=0.01)
    simulation.robots.first.body.set_position("arm_joint", math.pi / 2)
    side = simulated_shape(simulation).outline.corners
    assert side[:, 1].max() == pytest.approx(0.5, abs=0.01)
    assert side[:, 0].max() == pytest.approx(0.3, abs=0.01)


BOXES = World(
    "boxes",
    (
        floor(),
        box("ahead", (0.2, 0.8, 0.4), 1.0, 0.0),
        box("behind", (0.1, 2.0, 0.4), -0.9, 0.0),
        box("aside", (0.8, 0.1, 0.4), 0.0, -0.8),
    ),
)


@pytest.mark.parametrize("any_heading", [True, False])
@pytest.mark.parametrize(("text", "fov"), [(CAR, 4.5), (CAR, 6.28), (SIDEWAYS, 6.28), (SIDEWAYS, 4.5)])
def test_other_bases_reach_goals_without_a_map(text, fov, any_heading):
    """With a lidar that sees all around, and with one that does not see the wall behind the robot."""
    simulation = Simulation(_robot(_with_lidar(text, fov)), BOXES)
    goal = PlanarPose(2.0, 0.3, 0.8)
    trip = go_to_without_map(simulation, goal, any_heading=any_heading, arrive=0.1, max_speed=(0.6, 1.5))
    assert trip.reached, trip.status
    assert not trip.collided
    assert trip.off <= 0.1
    assert any_heading or trip.turned_off < 0.1


def test_a_car_whose_heading_is_free_stops_with_its_base_at_the_goal():
    """The axle is 0.2 m behind the base's origin, which must be at the goal whatever the heading is."""
    text = CAR.replace(
        '<robot name="car">',
        '<robot name="car"><link name="root"/><joint name="j" type="fixed">'
        '<parent link="root"/><child link="base"/><origin xyz="-0.2 0 0"/></joint>',
    )
    settings = NavigatorSettings(limits=ControllerLimits(angle=math.pi))
    simulation = Simulation(_robot(text))
    trip = go_to(simulation, PlanarPose(0.8, 1.0, 3.0), settings=settings)
    assert trip.reached, trip.status
    assert trip.off <= 0.011


def test_a_robot_without_a_lidar_cannot_drive_without_a_map():
    with pytest.raises(KbotError, match="declares no level lidar"):
        go_to_without_map(Simulation(_robot(CAR)), PlanarPose(1.0, 0.0))
