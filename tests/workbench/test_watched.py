"""A page's requests do not change a run, and the robot starts at its start pose."""

import pytest

from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim import Simulation
from kbot.workbench.protocol import Drive
from kbot.workbench.serve import open_session

pytestmark = pytest.mark.usefixtures("keeps_up")


def test_a_run_with_a_page_is_bit_for_bit_the_same():
    """Time advances in the uneven steps of a page's wall clock, and everything is read after each."""
    simulations: list[Simulation] = []
    session = open_session("kbot", simulate=True, world="boxes", on_start=simulations.append)
    (watched,) = simulations
    session.handle(Drive(0.3, 0.4), 1)
    for index in range(150):
        session.advance(0.011 + 0.0037 * (index % 5))
        session.state()
        watched.link_poses()
        session.handle(Drive(0.3, 0.4), 1)
    alone = Simulation("kbot", "boxes")
    alone.cmd_vel(0.3, 0.4)
    alone.step(watched.steps)
    assert watched.steps > 500
    assert watched.state_sha256() == alone.state_sha256()
    assert watched.odometry == alone.odometry


def test_the_robot_starts_at_its_start_pose():
    simulations: list[Simulation] = []
    open_session("kbot", simulate=True, on_start=simulations.append, start=PlanarPose(1.0, -0.5, 2.0))
    pose = simulations[0].ground_truth.pose
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((1.0, -0.5, 2.0))
