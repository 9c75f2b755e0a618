"""A simulated KBot as a ROS 2 node, with Debian's Fast DDS as the peer: a DDS of another vendor."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SOURCES = Path(__file__).with_name("fastdds")
DRIVING_SECONDS = 5


@pytest.fixture(scope="module")
def peer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The peer program, built with types that Fast DDS generates for the names of ROS."""
    if shutil.which("fastddsgen") is None or shutil.which("cmake") is None:
        pytest.skip("Fast DDS is not installed (make test-peers installs it)")
    folder = tmp_path_factory.mktemp("fastdds")
    for command in (("cmake", "-S", str(SOURCES), "-B", str(folder)), ("cmake", "--build", str(folder))):
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, done.stderr + done.stdout
    return folder / "peer"


def test_fast_dds_receives_topics_and_drives_the_robot(peer: Path) -> None:
    domain = 100 + os.getpid() % 100
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    simulating = subprocess.Popen(
        (sys.executable, "-m", "kbot", "sim", "kbot", "--headless", "--ros2", "--duration", "12", "--json"),
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert simulating.stderr is not None
    assert f"domain {domain}" in simulating.stderr.readline()
    done = subprocess.run(
        (str(peer), str(domain), str(DRIVING_SECONDS)),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    received = json.loads(done.stdout)
    assert received["clocks"] > 10  # 50 per second are sent; best effort loses some
    assert 0.0 < received["seconds"] < 12.0
    assert received["description"] > 1000  # a late subscriber also receives the URDF
    report, errors = simulating.communicate(timeout=60)
    assert simulating.returncode == 0, errors
    # 0.2 m/s for most of the time, and for half a second more until the watchdog stops it
    assert 0.3 < json.loads(report)["distance_m"] < 0.2 * (DRIVING_SECONDS + 1)
