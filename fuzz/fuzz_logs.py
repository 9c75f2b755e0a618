"""Fuzzes CSV logs for kbot identify. Errors are a KbotError."""

from contextlib import suppress
from pathlib import Path

from choices import Choices
from edits import edited

from kbot.identify.csv_file import read_csv
from kbot.identify.identification import identify
from kbot.identify.nominal import read_nominal
from kbot.text import KbotError

FILE = Path("log.csv")
WHEELS = "left_wheel_velocity,right_wheel_velocity"
MOVES = ((5, 5, 0.175, 0, 0), (4, 6, 0.17, 0.03, 0.4), (6, 4, 0.17, -0.03, -0.4), (-2, 2, 0, 0, 0.8))
SEEDS = [
    "\n".join(
        [
            f"duration,{WHEELS},displacement_x,displacement_y,displacement_yaw,cmd_v,cmd_w,imu_wz",
            *(",".join(map(str, (1, *move, 0.1 * move[0], move[4], move[4]))) for move in MOVES * 8),
        ]
    ).encode(),
    "\n".join(
        [
            f"time,{WHEELS},pose_x,pose_y,pose_yaw",
            *(f"{t},{5 + t % 3},{5 - t % 2},{0.17 * t},{0.01 * t * t},{0.1 * t}" for t in range(20)),
        ]
    ).encode(),
]
WORDS = [
    b",", b",,", b"\n", b"nan", b"1e308", b"-1e308", b"1e-308", b"0", b"-", b"1e9", b"duration", b"time",
    b"pose_x", b"displacement_x", b"cmd_v", b"imu_wz", b'"', b";", b"\xff", b"\xef\xbb\xbf",
]  # fmt: skip
NOMINAL = read_nominal("kbot", {}, {}, (), None)


def one_input(choices: Choices) -> None:
    """A log that is read and identified."""
    FILE.write_bytes(edited(choices, SEEDS, WORDS))
    with suppress(KbotError):
        identify(read_csv(str(FILE)), NOMINAL).to_text()


TARGETS = {"logs": one_input}
