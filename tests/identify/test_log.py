"""Tests the displacements of a log."""

import numpy as np

from kbot.identify.log import DriveLog, motions_of


def test_poses_in_different_frames_have_no_displacement_between_them():
    places = [0.0, 1.0, 2.0, 50.0, 51.0, 52.0, 53.0]
    log = DriveLog(
        path="log",
        durations=np.ones(7),
        wheel_speeds=np.ones((7, 2)),
        displacements=np.full((7, 3), np.nan),
        poses=np.column_stack([places, np.zeros(7), np.zeros(7)]),
        commands=np.full((7, 2), np.nan),
        gyro=np.full(7, np.nan),
        new_frames=(3,),
    )
    motions = motions_of(log)
    assert motions.displacements[:, 0].tolist() == [1.0] * 5
    assert motions.start.tolist() == [1, 2, 4, 5, 6]
