"""A robot that must not drive on is reported with the reason."""

from kbot.kinematics import PlanarPose
from kbot.navigation.perception.fault_watch import FaultWatch

STEP = 0.05


def _reports(speed=1.0, wheels=1.0, by_scans=1.0, fits=True, seconds=3.0):
    """The reports of a watch while a robot drives straight with these speeds in m/s."""
    watch = FaultWatch(frozen=0.6, lost=0.3)
    times = [number * STEP for number in range(round(seconds / STEP))]
    reports = [
        watch.update(time, speed, PlanarPose(wheels * time), PlanarPose(by_scans * time), fits)
        for time in times
    ]
    return [(time, report) for time, report in zip(times, reports, strict=True) if report]


def test_a_robot_that_drives_is_not_reported():
    assert _reports() == []
    assert _reports(by_scans=0.7) == []  # wheels that slip a little
    assert _reports(speed=0.0, wheels=0.0, by_scans=0.0) == []


def test_frozen_odometry_is_reported():
    time, report = _reports(wheels=0.0)[0]
    assert 0.6 <= time < 0.7
    assert report == "the odometry reports no motion for 0.6 s although the robot is commanded to drive"


def test_scans_that_do_not_fit_are_reported():
    time, report = _reports(fits=False)[0]
    assert 0.3 <= time < 0.4
    assert report.startswith("the scans do not fit those before")
    assert _reports(fits=None) == []  # in the open, nothing can be judged


def test_wheels_that_turn_while_the_robot_stands_are_reported():
    time, report = _reports(by_scans=0.1)[0]
    assert time < 1.1
    assert report.startswith("the wheels report ")
    assert report.endswith("the scans show that the robot does not move: it is lifted, blocked or slips")
