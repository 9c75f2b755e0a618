"""The npm clients that browsers use, Foxglove's and roslibjs, connect to a simulated KBot."""

import base64
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from kbot.messages import Odometry
from kbot.record.encodings.serialization import decode_cdr

from .conftest import install_npm, node_programs, wait_until

HERE = Path(__file__).parent
PACKAGES = ("@foxglove/ws-protocol@0.8.0", "ws@8", "roslib@2")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the installed clients and the test programs that use them."""
    found = install_npm(tmp_path_factory.mktemp("npm"), PACKAGES)
    for program in HERE.glob("*.mjs"):
        shutil.copy(program, found)
    return found


@pytest.fixture(scope="module")
def addresses(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """A simulation in real time. Yields the addresses of its two bridges."""
    log = tmp_path_factory.mktemp("log") / "kbot.log"
    with log.open("w") as stream:
        process = subprocess.Popen(
            [sys.executable, "-m", "kbot", "sim", "kbot", "--headless", "--foxglove", "--rosbridge"],
            stderr=stream,
            stdout=stream,
        )
    try:
        wait_until(lambda: len(re.findall(r"ws://\S+", log.read_text())) == 2, "two addresses")
        foxglove, rosbridge = re.findall(r"ws://\S+", log.read_text())
        yield {"foxglove": foxglove, "rosbridge": rosbridge}
    finally:
        process.terminate()
        process.wait(60)


def run(folder: Path, *words: str) -> dict:
    done = subprocess.run(
        [node_programs()[0], *words], cwd=folder, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 0, f"{done.returncode}: {done.stdout}\n{done.stderr}"
    return json.loads(done.stdout)


@pytest.mark.parametrize("subprotocol", ["foxglove.websocket.v1", "foxglove.sdk.v1"])
def test_foxglove_client_receives_topics_and_drives(
    folder: Path, addresses: dict[str, str], subprotocol: str
) -> None:
    found = run(folder, "foxglove_client.mjs", addresses["foxglove"], subprotocol)
    assert found["statuses"] == []
    assert {"/odom", "/tf", "/tf_static", "/joint_states", "/clock", "/robot_description"} <= set(
        found["topics"]
    )
    assert found["parameters"] == [{"name": "/use_sim_time", "value": True}]
    assert found["latched"] > 50
    assert {after - before for before, after in pairwise(found["stamps"])} == {20_000_000}
    last = decode_cdr(base64.b64decode(found["last"]), Odometry)
    assert last.header.stamp.nanoseconds == found["stamps"][-1]
    assert last.twist.twist.linear.x == pytest.approx(0.3, abs=0.02)


def test_roslibjs_receives_topics_and_drives(folder: Path, addresses: dict[str, str]) -> None:
    found = run(folder, "rosbridge_client.mjs", addresses["rosbridge"])
    assert found["speed"] == pytest.approx(0.3, abs=0.02)
    assert found["parameter"] is True
    assert {"/odom", "/cmd_vel"} <= set(found["topics"])
