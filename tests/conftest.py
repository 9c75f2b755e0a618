"""Fixtures for all tests: the shared reference data, a browser, and measured processes."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from threading import Timer
from typing import Any, TypeVar

import pytest
from hypothesis import settings

Report = TypeVar("Report", pytest.TestReport, pytest.CollectReport)

settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

NO_SKIP = bool(os.environ.get("KBOT_NO_SKIP"))
"""If set, a skipped test fails instead, so that a run proves that everything was tested."""

CHROMIUMS = (
    "chromium-headless-shell",  # without a browser's own windows: the tests take a sixth less time
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
)


def pytest_configure() -> None:
    """Let signals reach the programs that tests start, show their tracebacks, and compile modules once.

    A shell starts background jobs with SIGINT ignored, and nohup ignores SIGHUP. Child processes inherit
    this, including the programs whose end by these signals is tested.
    """
    os.environ["KBOT_DEBUG"] = "1"  # programs that tests start print the traceback of an internal error
    # Tests start hundreds of programs. Each would compile all modules again without their bytecode.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if sys.platform != "win32" and signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.hookimpl(tryfirst=True)  # before -m selects by the marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests that need a browser, and run them first: their files take longest, and the last
    worker to finish should not be a browser's."""
    for item in items:
        if "chromium" in getattr(item, "fixturenames", ()):
            item.add_marker("browser")
    items.sort(key=lambda item: item.get_closest_marker("browser") is None)


@pytest.fixture
def tmp_path(tmp_path: Path) -> Path:
    """A folder without siblings.

    KBot searches the siblings of a package for packages, and other tests write packages next to `tmp_path`.
    """
    folder = tmp_path / "here"
    folder.mkdir()
    return folder


@pytest.fixture
def no_packages(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Run in an empty folder `elsewhere`, without ROS's variables for packages."""
    for name in ("AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH"):
        monkeypatch.delenv(name, raising=False)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of reference data: `KBOT_SHARED`, or `shared` next to the repository."""
    folder = Path(os.environ.get("KBOT_SHARED") or Path(__file__).parents[2] / "shared")
    if not folder.is_dir():
        pytest.skip(f"the reference data is not at {folder} (set KBOT_SHARED)")
    return folder


@pytest.fixture
def drive_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with a scenario of one second in `drive.scenario.yaml`."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drive.scenario.yaml").write_text(
        "duration: 1\nsteps:\n  - command: {linear: 0.2}\nexpect:\n  - final_forward: {min: 0.15}\n"
    )
    return tmp_path


@pytest.fixture(scope="session")
def straight_policy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A policy in an ONNX file that drives at 0.3 m/s, turns towards the goal at up to 1 rad/s, and ignores
    the four lidar sectors that it sees: angular = goal_sin / 2."""
    import numpy as np
    from onnx import TensorProto, helper, numpy_helper

    from kbot.learn.interface.policy_interface import PolicyInterface, Sectors
    from kbot.learn.policies.policy import save_policy

    interface = PolicyInterface("goal", linear=(0.0, 0.6), angular=(-2.0, 2.0), lidar=Sectors(4))
    names = [field.name for field in interface.inputs]
    weights = np.zeros((2, len(names)), np.float32)
    weights[1, names.index("goal_sin")] = 0.5
    graph = helper.make_graph(
        [helper.make_node("Gemm", ["seen", "weights"], ["action"], transB=1)],
        "straight",
        [helper.make_tensor_value_info("seen", TensorProto.FLOAT, ["batch", len(names)])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, ["batch", 2])],
        [numpy_helper.from_array(weights, "weights")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    file = tmp_path_factory.mktemp("policy") / "straight.onnx"
    save_policy(model.SerializeToString(), interface, file)
    return file


@pytest.fixture(scope="session")
def chromium() -> str:
    """The path of Chromium: `KBOT_CHROMIUM`, or the first of the usual names that exists."""
    names = filter(None, (os.environ.get("KBOT_CHROMIUM"), *CHROMIUMS))
    path = next((found for found in map(shutil.which, names) if found), None)
    if path is None:
        pytest.skip("Chromium is not installed (install it, or set KBOT_CHROMIUM to its path)")
    return path


CHROMIUM_ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--webgl-antialiasing-mode=none",  # smooth edges cost two fifths of the time it takes to draw a frame
    "--host-resolver-rules=MAP evil.example 127.0.0.1",
)


class SharedBrowser:
    """The Chromium of a worker. Starting it takes longer than most tests in it.

    Its driver runs an event loop in this thread, so it stops before a test without a browser, which may start
    its own loop.
    """

    def __init__(self) -> None:
        self._driver: Any = None
        self._browser: Any = None

    def start(self, path: str) -> Any:
        playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
        if self._driver is None:
            self._driver = playwright.sync_playwright().start()
            self._browser = self._driver.chromium.launch(executable_path=path, args=[*CHROMIUM_ARGUMENTS])
        return self._browser

    def stop(self) -> None:
        if self._driver is not None:
            self._browser.close()
            self._driver.stop()
            self._driver = None


SHARED_BROWSER = SharedBrowser()


@pytest.fixture(scope="session")
def chromium_arguments() -> tuple[str, ...]:
    return CHROMIUM_ARGUMENTS


@pytest.fixture(scope="module")
def browser(chromium: str) -> Any:
    """A browser for which `evil.example` is this machine, as after DNS rebinding."""
    return SHARED_BROWSER.start(chromium)


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("browser") is None:
        SHARED_BROWSER.stop()


def pytest_sessionfinish() -> None:
    SHARED_BROWSER.stop()


@dataclass(frozen=True)
class Ended:
    """The exit status, output and resource use of a `kbot` process. Windows does not measure its use."""

    status: int
    out: str
    err: str
    cpu_s: float = 0.0
    peak_bytes: int = 0

    def is_bounded(self) -> bool:
        """Whether it ended within 10 s of CPU time and 1 GB of memory, and not by a signal."""
        return self.status >= 0 and self.cpu_s < 10 and self.peak_bytes < 1e9

    def is_refusal(self) -> bool:
        """Whether it was bounded and rejected its input with an error on stderr, status 2 and no traceback.

        `check` may report the error as a finding instead: on stdout, with status 1.
        """
        errors = {2: self.err, 1: self.out}.get(self.status, "")
        return self.is_bounded() and "error" in errors and "Traceback" not in self.out + self.err


class KbotProcesses:
    """Runs `kbot` in processes that need no time to import it (see kbot_processes.py)."""

    def __init__(self) -> None:
        self._socket, theirs = socket.socketpair()
        server = [sys.executable, str(Path(__file__).parent / "kbot_processes.py"), str(theirs.fileno())]
        self._server = subprocess.Popen(server, pass_fds=[theirs.fileno()], start_new_session=True)
        theirs.close()

    def run(self, *words: str, cwd: Path, env: dict[str, str]) -> Ended:
        request = json.dumps({"words": words, "cwd": str(cwd), "env": env}) + "\n"
        out_reader, out_writer = os.pipe()
        err_reader, err_writer = os.pipe()
        with Path(os.devnull).open("rb") as nothing:
            streams = [nothing.fileno(), out_writer, err_writer]
            socket.send_fds(self._socket, [request.encode()], streams)
        os.close(out_writer)
        os.close(err_writer)
        # a process that waits for ever uses no CPU time, so its limit does not end it
        timeout = Timer(300, os.killpg, (self._server.pid, signal.SIGKILL))
        timeout.start()
        with ThreadPoolExecutor() as readers:
            out, err = readers.map(_read_text, (out_reader, err_reader))
        answer = self._socket.makefile().readline()
        timeout.cancel()
        if not answer:
            pytest.fail(f"kbot {' '.join(words)} did not end within 300 s")
        return Ended(out=out, err=err, **json.loads(answer))

    def close(self) -> None:
        self._socket.close()
        self._server.wait()


def _read_text(stream: int) -> str:
    with os.fdopen(stream, encoding="utf-8", errors="replace") as file:
        return file.read()


@pytest.fixture(scope="session")
def kbot_processes() -> Iterator[KbotProcesses]:
    processes = KbotProcesses()
    yield processes
    processes.close()


@pytest.fixture
def start_kbot() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start `kbot WORDS` with pipes, to use it while it runs: `start_kbot("view", "a.urdf")`.

    It is killed if it still runs after the test, so that a test that fails does not wait for it.
    """
    with ExitStack() as programs:

        def start(*words: str | Path, env: dict[str, str] | None = None) -> subprocess.Popen[str]:
            command = [sys.executable, "-m", "kbot", *map(str, words)]
            pipe = subprocess.PIPE
            program = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=env)
            programs.enter_context(program)
            programs.callback(program.kill)
            return program

        yield start


@pytest.fixture
def run_kbot(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[..., Ended]:
    """Run `kbot WORDS` in a separate process: `run_kbot("check", "a.xacro", cwd=folder)`."""

    def run(*words: str | Path, cwd: Path = tmp_path, env: dict[str, str] | None = None) -> Ended:
        arguments, environment = [*map(str, words)], os.environ | (env or {})
        if sys.platform != "win32":
            processes: KbotProcesses = request.getfixturevalue("kbot_processes")
            return processes.run(*arguments, cwd=cwd, env=environment)
        done = subprocess.run(  # Windows cannot fork a process
            [sys.executable, "-m", "kbot", *arguments],
            cwd=cwd,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=300,
            check=False,
        )
        return Ended(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture
def measured_kbot(run_kbot: Callable[..., Ended]) -> Callable[..., Ended]:
    """As `run_kbot`, where the system can measure and limit a process.

    After 10 s of CPU time, the system stops the process, and its status is negative. CPU time does not depend
    on the load of the machine.
    """
    if sys.platform == "win32":  # it lacks setrlimit and wait4, which kbot_processes.py uses
        pytest.skip("Windows has neither limits for a process nor its CPU time")
    return run_kbot


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    return _refuse_skip(report)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    report = yield
    return _refuse_skip(report)


def _refuse_skip(report: Report) -> Report:
    if NO_SKIP and report.skipped and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"skipped, which KBOT_NO_SKIP forbids: {report.longrepr}"
    return report
