"""What a page asks for and is told changes nothing of a run; and where the robot starts is kept to."""

import pytest

from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim import Simulation
from kbot.workbench.protocol import Drive
from kbot.workbench.serve import open_session

pytestmark = pytest.mark.usefixtures("keeps_up")


def test_a_run_is_the_same_bit_for_bit_with_a_page_that_watches():
    """Time passes in the uneven pieces that a page's wall clock gives, and all is read after each."""
    attended: list[Simulation] = []
    session = open_session("kbot", simulate=True, world="boxes", attend=attended.append)
    (watched,) = attended
    session.obey(Drive(0.3, 0.4), 1)
    for index in range(150):
        session.advance(0.011 + 0.0037 * (index % 5))
        session.state()
        watched.link_poses()
        session.obey(Drive(0.3, 0.4), 1)
    alone = Simulation("kbot", "boxes")
    alone.cmd_vel(0.3, 0.4)
    alone.step(watched.steps)
    assert watched.steps > 500
    assert watched.state_sha256() == alone.state_sha256()
    assert watched.odometry == alone.odometry


def test_the_robot_starts_where_it_is_put():
    attended: list[Simulation] = []
    open_session("kbot", simulate=True, attend=attended.append, start=PlanarPose(1.0, -0.5, 2.0))
    pose = attended[0].ground_truth.pose
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((1.0, -0.5, 2.0))
