"""Whatever is commanded: the wheels do not slip unnoticed, and how a run is cut does not matter."""

from math import hypot

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kbot.sim import Simulation

SPEEDS = st.tuples(st.floats(-0.5, 0.5), st.floats(-2.0, 2.0))
DRIVES = st.lists(st.tuples(SPEEDS, st.integers(1, 400)), min_size=1, max_size=5)
QUIET = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@QUIET
@given(drives=DRIVES)
def test_odometry_knows_where_the_robot_is(kbot_robot, drives):
    """On a plane, within the grip of its tyres: a few millimetres and a tenth of a degree, whatever the
    way; the way lags behind the heading by 2 ms."""
    sim = Simulation(kbot_robot)
    for (linear, angular), steps in drives:
        sim.cmd_vel(linear, angular)
        sim.step(steps)
    odometry, truth = sim.odometry.pose, sim.ground_truth.pose
    assert hypot(odometry.x - truth.x, odometry.y - truth.y) < 0.008
    assert abs(odometry.yaw - truth.yaw) < 0.002
    assert abs(sim.link_pose("base_link").translation[2] - 0.04) < 0.003


@QUIET
@given(drives=DRIVES, cut=st.integers(1, 37))
def test_how_a_run_is_cut_into_calls_does_not_matter(kbot_robot, drives, cut):
    whole, pieces = Simulation(kbot_robot), Simulation(kbot_robot)
    for (linear, angular), steps in drives:
        whole.cmd_vel(linear, angular)
        whole.step(steps)
        pieces.cmd_vel(linear, angular)
        for start in range(0, steps, cut):
            pieces.step(min(cut, steps - start))
    assert whole.state_sha256() == pieces.state_sha256()
    assert whole.odometry == pieces.odometry
