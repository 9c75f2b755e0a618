"""For any command, odometry is accurate and the result does not depend on how a run is split."""

from math import hypot

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kbot.sim import Simulation

SPEEDS = st.tuples(st.floats(-0.5, 0.5), st.floats(-2.0, 2.0))
DRIVES = st.lists(st.tuples(SPEEDS, st.integers(1, 400)), min_size=1, max_size=5)
QUIET = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@QUIET
@given(drives=DRIVES)
def test_odometry_agrees_with_ground_truth(kbot_robot, drives):
    """On a plane, within the grip of the tyres, the error is a few mm and 0.1 degrees on any path.

    The position lags behind the heading by 2 ms.
    """
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
def test_result_does_not_depend_on_how_a_run_is_split(kbot_robot, drives, cut):
    whole, pieces = Simulation(kbot_robot), Simulation(kbot_robot)
    for (linear, angular), steps in drives:
        whole.cmd_vel(linear, angular)
        whole.step(steps)
        pieces.cmd_vel(linear, angular)
        for start in range(0, steps, cut):
            pieces.step(min(cut, steps - start))
    assert whole.state_sha256() == pieces.state_sha256()
    assert whole.odometry == pieces.odometry
