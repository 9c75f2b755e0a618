"""What a page asks for and is told changes nothing of a run; and where the robot starts is kept to."""

import pytest

from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim import Simulation
from kbot.workbench.protocol import Drive
from kbot.workbench.serve import open_session

pytestmark = pytest.mark.usefixtures("keeps_up")


def test_a_run_is_the_same_bit_for_bit_with_a_page_that_watches():
    """Time passes in the uneven pieces that a page's wall clock gives, and all is read after each."""
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


def test_the_robot_starts_where_it_is_put():
    simulations: list[Simulation] = []
    open_session("kbot", simulate=True, on_start=simulations.append, start=PlanarPose(1.0, -0.5, 2.0))
    pose = simulations[0].ground_truth.pose
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((1.0, -0.5, 2.0))
