"""Tests the reader of CSV logs: columns, empty cells, times, and errors with file, line and column."""

import numpy as np
import pytest

from kbot.identify.csv_file import read_csv
from kbot.identify.log import motions_of
from kbot.text import KbotError

HEADER = "duration,left_wheel_velocity,right_wheel_velocity,displacement_x,displacement_y,displacement_yaw"


def log(tmp_path, text):
    file = tmp_path / "log.csv"
    file.write_text(text)
    return read_csv(str(file))


def error(tmp_path, text, use=read_csv):
    file = tmp_path / "log.csv"
    file.write_text(text)
    with pytest.raises(KbotError) as caught:
        motions_of(read_csv(str(file)))
    return str(caught.value).removeprefix(str(file))


def test_columns_are_found_by_name_in_any_order(tmp_path):
    found = log(
        tmp_path,
        "displacement_yaw,right_wheel_velocity, duration ,left_wheel_velocity,displacement_x,displacement_y\n"
        "6,3,1,2,4,5\n",
    )
    assert found.durations.tolist() == [1.0]
    assert found.wheel_speeds.tolist() == [[2.0, 3.0]]
    assert found.displacements.tolist() == [[4.0, 5.0, 6.0]]


def test_empty_cells_are_absent(tmp_path):
    found = log(tmp_path, f"{HEADER},cmd_v,cmd_w,imu_wz\n1,2,3,,5,6,,8,\n\n")
    assert np.isnan(found.displacements[0]).tolist() == [True, False, False]
    assert np.isnan(found.commands[0]).tolist() == [True, False]
    assert np.isnan(found.gyro).all()


def test_files_of_spreadsheets_are_read(tmp_path):
    file = tmp_path / "log.csv"
    file.write_bytes(b"\xef\xbb\xbf" + (f'"{HEADER}"'.replace(",", '","') + "\r\n1,2,3,4,5,6\r\n").encode())
    assert read_csv(str(file)).displacements.tolist() == [[4.0, 5.0, 6.0]]


def test_times_are_those_of_the_ends_of_intervals(tmp_path):
    found = log(
        tmp_path, HEADER.replace("duration", "time") + "\n10,1,1,0,0,0\n10.5,1,1,0,0,0\n11.5,1,1,0,0,0\n"
    )
    assert np.isnan(found.durations[0])
    assert found.durations[1:].tolist() == [0.5, 1.0]


def test_poses_become_displacements_in_the_frame_of_the_pose_before(tmp_path):
    header = HEADER.replace("displacement", "pose")
    # from (1, 2) facing +y to (0, 4) facing -x: 2 ahead, 1 to the left, a quarter turn to the left
    quarter = np.pi / 2
    found = log(
        tmp_path,
        f"{header}\n1,1,1,1,2,{quarter}\n1,1,1,,,\n1,2,1,0,4,{-np.pi}\n" + f"1,1,1,0,4,{-np.pi}\n" * 3,
    )
    motions = motions_of(found)
    assert (motions.start[0], motions.stop[0]) == (1, 3)  # over the interval without a pose
    np.testing.assert_allclose(motions.displacements[0], [2.0, 1.0, quarter], atol=1e-12)


def test_intervals_without_wheel_speeds_are_left_out(tmp_path):
    rows = ["1,1,1,1,0,0"] * 4 + ["1,,1,1,0,0"]
    motions = motions_of(log(tmp_path, "\n".join([HEADER, *rows]) + "\n"))
    assert motions.stop.tolist() == [1, 2, 3, 4]


ROWS = "1,1,1,1,0,0\n" * 5
BAD = {
    "no header": ("", ":1:1: the header is missing"),
    "no rows": (HEADER, ":1:1: the log has no rows"),
    "semicolons": (HEADER.replace(",", ";"), ":1:1: the columns are separated by ';'"),
    "a misspelt column": (HEADER.replace("left_wheel_v", "left_wheel_w"), ":1:10: the column 'left_wheel_v"),
    "a missing column": (HEADER.replace("_yaw", "_z"), ":1:1: the column 'displacement_yaw' is missing"),
    "no reference": ("duration,left_wheel_velocity,right_wheel_velocity", ":1:1: the log has no reference"),
    "no time": (HEADER.replace("duration", "t"), ":1:1: the log has neither 'duration' nor 'time'"),
    "a column twice": (HEADER + ",duration", ":1:98: the column 'duration' occurs twice"),
    "both references": (HEADER + ",pose_x,pose_y,pose_yaw", ":1:98: the log has both"),
    "half a command": (HEADER + ",cmd_v", ":1:1: the column 'cmd_w' is missing"),
    "too few cells": (f"{HEADER}\n{ROWS}1,2,3", ":7:1: the row has 3 cells, and the header 6"),
    "too many cells": (f"{HEADER}\n{ROWS}1,2,3,4,5,6,7", ":7:1: the row has 7 cells"),
    "a large number": (
        f"{HEADER}\n1,1,1,2e6,0,0",
        ":2:7: displacement_x is 2e6: the largest accepted value is 1e+06. Check the unit",
    ),
    "a word": (f"{HEADER}\n1,1, one,1,0,0", ":2:6: right_wheel_velocity is not a number: 'one'"),
    "nan": (f"{HEADER}\n1,1,nan,1,0,0", ":2:5: right_wheel_velocity is nan. Leave the cell empty"),
    "infinity": (f"{HEADER}\n1,1,1,inf,0,0", ":2:7: displacement_x is inf"),
    "tabs": (f"{HEADER}\n1,1,1,1,0,0".replace(",", "\t"), ":1:1: the columns are separated by tabs"),
    "no duration": (f"{HEADER}\n0,1,1,1,0,0", ":2:1: the duration must be above 0 s"),
    "few rows": (f"{HEADER}\n1,1,1,1,0,0", " has wheel speeds and a reference in too few intervals: 1"),
    "no motion": (HEADER + "\n1,0,0,0,0,0" * 9, " shows no motion: the wheels do not turn"),
    "a lifted robot": (HEADER + "\n1,1,1,0,0,0" * 9, ": the wheels turn, but the reference does not move"),
    "empty reference": (HEADER + "\n1,1,1,,," * 9, " has no reference: the cells"),
    "clock back": (
        HEADER.replace("duration", "time") + "\n1,1,1,1,0,0\n2,1,1,1,0,0\n1.5,1,1,1,0,0",
        ":4:1: the clock jumps back or stops: 2 s, then 1.5 s",
    ),
    "a repeated time": (
        HEADER.replace("duration", "time") + "\n1,1,1,1,0,0\n2,1,1,1,0,0\n2,1,1,1,0,0",
        ":4:1: the clock jumps back or stops: 2 s, then 2 s. Sort the rows by time, remove repeated ones",
    ),
    "clock ahead": (
        HEADER.replace("duration", "time") + "\n1,1,1,1,0,0\n2,1,1,1,0,0\n1e9,1,1,1,0,0",
        ":4:1: the clock jumps ahead by 1e+09 s",
    ),
    "a missing time": (HEADER.replace("duration", "time") + "\n,1,1,1,0,0", ":2:1: the time is missing"),
}


@pytest.mark.parametrize("name", BAD)
def test_wrong_logs_have_one_clear_error(tmp_path, name):
    text, expected = BAD[name]
    assert error(tmp_path, text).startswith(expected)
