"""Executes runs on a Ray cluster: on the processors of all its machines.

Each Ray task passes its run to a process with the limits of `kbot try`, so that results do not depend on Ray.
A run whose machine or process is lost is executed again by Ray. Its result arrives once.
"""

from __future__ import annotations

import logging
import os
import re
import socket
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from kbot.sweep.executor import Finished
from kbot.sweep.processes import AHEAD
from kbot.text import KbotError
from kbot.text.extras import needs_extra
from kbot.text.notes import note
from kbot.text.temporary import TemporaryFolder
from kbot.trials.pool import ATTEMPTS, LimitedTask, Outcome, Pool, Task, result_of, run_task, seconds_of
from kbot.trials.results import TrialResult
from kbot.worker.cores import available_cores

if TYPE_CHECKING:
    from types import ModuleType

    from ray import ObjectRef

T = TypeVar("T")

LOCAL = "local"
"""The address of a cluster that this process starts on this machine, and ends."""
WAIT_SECONDS = 1.0
"""Time after which Ctrl-C and a lost cluster are noticed."""
PATIENCE_SECONDS = 30.0
"""Time without any processor in the cluster after which a note is printed."""
HEAD_CHECK_SECONDS = 5.0
"""Time between two checks of the size of the cluster."""
FAILED_HEAD_CHECKS = 3
"""Checks in a row that the head of the cluster does not answer before it counts as lost."""
CONNECT_SECONDS = 10.0
"""Time in which a cluster must answer."""
_STORE_BYTES = 80_000_000
"""Memory for objects of a local cluster, close to Ray's minimum. Runs and results are small."""
_NOT_SENT = (".git", ".venv", "node_modules", "__pycache__")
"""Folders of the working directory that no run needs. Ray also leaves out those in .gitignore."""
_PATH_END = r"""(?=[/\\:;,'"]|$)"""
"""What follows the path of a folder in a path, a list of paths or a message."""
_ADDRESS = re.compile(r"ray(://\S+)?|auto|[^\s:/]+:\d+|\[[0-9a-fA-F:]+\]:\d+")


def parse_place(text: str) -> str:
    """The address of a cluster, as Ray takes it, for `ray`, `ray://HOST:PORT`, `HOST:PORT` or `auto`.

    Raises:
        KbotError: the text is something else.
    """
    if not _ADDRESS.fullmatch(text):
        raise KbotError(
            f"--on {text} is not the address of a cluster. Use ray for this machine, "
            "ray://HOST:10001 for a cluster, or HOST:6379 on a machine of the cluster"
        )
    return LOCAL if text == "ray" else text


@dataclass(frozen=True, slots=True)
class _Call:
    """What a Ray task executes.

    folder    the working directory of the process that asks
    is_here   whether the task runs on the same machine, in the same files
    versions  of the programs on which results depend
    """

    item: LimitedTask
    folder: str
    is_here: bool
    versions: Mapping[str, str]


class RayCluster:
    """A Ray cluster: one that exists, or one on this machine that ends with the block."""

    def __init__(
        self,
        address: str,
        jobs: int | None = None,
        limit: float | None = None,
        versions: Mapping[str, str] | None = None,
        not_sent: Sequence[str] = (),
    ) -> None:
        """
        jobs      runs at the same time; by default one for each core of the cluster
        limit     replaces the processor time in seconds that each run may take
        versions  of programs, by the name of their package, that each machine must have
        not_sent  folders of the working directory that other machines do not need
        """
        self._address, self._limit = address, limit
        self._jobs = jobs
        self._versions = dict(versions or {})
        self._not_sent = not_sent
        self._running: dict[ObjectRef[Any], tuple[int, LimitedTask]] = {}
        self._attempts: dict[int, int] = {}
        self._opened = ExitStack()
        self._head = ""
        """The address of the head, unless Ray reports its loss."""
        self._checked, self._failed_checks = 0.0, 0
        self._processors = 0
        self._ended = threading.Event()
        self._ray: ModuleType
        self._remote: Any = None

    @property
    def capacity(self) -> int:
        ahead = AHEAD * max(1, self._processors)
        # of a cluster of its own, the number of processors is the limit
        return ahead if self._jobs is None or self._address == LOCAL else min(self._jobs, ahead)

    def submit(self, run: int, task: Task) -> None:
        item = (task, task.limit(self._limit))
        call = _Call(item, str(Path.cwd()), self._address == LOCAL, self._versions)
        with _connected():
            self._running[self._remote.remote(call)] = (run, item)

    def wait(self) -> Finished:
        waited = 0.0
        while True:
            self._require_head()
            ready = self._ready()
            if ready is None:
                waited += WAIT_SECONDS
                if waited >= PATIENCE_SECONDS and not self._processors:
                    note("the cluster has no processors at present. Waiting for one")
                continue
            run, item = self._running.pop(ready)
            outcome = self._outcome(ready, run, item)
            if outcome is not None:
                self._attempts.pop(run, None)
                return Finished(run, result_of(item, outcome))

    def __enter__(self) -> Self:
        ray = self._ray = _imported()
        options: dict[str, Any] = {}
        if self._address == LOCAL:
            folder = str(self._opened.enter_context(TemporaryFolder("ray")))
            options = {
                "num_cpus": self._jobs or available_cores(),
                "include_dashboard": False,
                "object_store_memory": _STORE_BYTES,
                "_temp_dir": folder,
            }
        else:
            if Path.cwd() == Path.cwd().parent:
                raise KbotError(
                    f"the working directory {Path.cwd()} is the root, which is too large to be sent to the "
                    "cluster. Run the command in the folder of the robot's package"
                )
            excluded = [*_NOT_SENT, *filter(None, map(_inside, self._not_sent))]
            options = {"runtime_env": {"working_dir": str(Path.cwd()), "excludes": excluded}}
        try:
            if self._address not in (LOCAL, "auto"):
                _require_answer(self._address)
            # Ray's own processes end with this one: kernel_fate_share in ray/_private/node.py
            with _without_stderr():
                ray.init(self._address, log_to_driver=False, logging_level=logging.CRITICAL, **options)
        except Exception as error:  # noqa: BLE001 - Ray raises many kinds
            self._opened.close()
            raise KbotError(_why(error, self._address)) from None
        self._opened.callback(ray.shutdown)
        if not self._address.startswith("ray://"):  # for these, Ray reports it
            self._head = ray.get_runtime_context().gcs_address
        self._processors = int(ray.cluster_resources().get("CPU", 0))
        threading.Thread(target=self._watch_processors, daemon=True).start()
        self._opened.callback(self._ended.set)
        self._remote = ray.remote(_run).options(num_cpus=1, max_retries=-1)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._running.clear()
        self._opened.close()

    def _watch_processors(self) -> None:
        """Keep the number of processors up to date. Ray answers only while the head of the cluster does."""
        while not self._ended.wait(HEAD_CHECK_SECONDS):
            with suppress(Exception):  # reported by the thread that waits for results
                self._processors = int(self._ray.cluster_resources().get("CPU", 0))

    def _require_head(self) -> None:
        """Raises KbotError: the head of the cluster is lost. Ray would end this process after a minute."""
        now = time.monotonic()
        if not self._head or now - self._checked < WAIT_SECONDS:
            return
        self._checked = now
        try:
            _require_answer(self._head)
            self._failed_checks = 0
        except OSError as error:
            self._failed_checks += 1
            if self._failed_checks == FAILED_HEAD_CHECKS:
                raise KbotError(_lost(error)) from None

    def _ready(self) -> ObjectRef[Any] | None:
        """A result that is ready. None after a while without one."""
        with _connected():
            ready, _ = self._ray.wait(list(self._running), num_returns=1, timeout=WAIT_SECONDS)
        return ready[0] if ready else None

    def _outcome(self, ready: ObjectRef[Any], run: int, item: LimitedTask) -> Outcome[TrialResult] | None:
        """The outcome of a run. None if it is executed again."""
        errors = self._ray.exceptions
        try:
            outcome: Outcome[TrialResult] = self._ray.get(ready)
        except errors.RayTaskError as error:
            raise KbotError(f"a machine of the cluster cannot run KBot: {_last_line(error)}") from None
        except errors.RayError as error:  # the machine or the process was lost
            self._attempts[run] = self._attempts.get(run, 0) + 1
            if self._attempts[run] >= ATTEMPTS:
                raise KbotError(_lost(error)) from None
            self.submit(run, item[0])
            return None
        except Exception as error:  # noqa: BLE001 - as in `_connected`
            raise KbotError(_lost(error)) from None
        if isinstance(outcome.error, _WrongMachine):
            raise outcome.error
        return outcome


class _WrongMachine(KbotError):
    """A machine of the cluster has other versions of programs."""


def _run(call: _Call) -> Outcome[TrialResult]:
    """Execute a run in a process of its own. Ray calls this function on a machine of the cluster."""
    here = call.folder
    if call.is_here:
        os.chdir(here)
    else:
        here = str(Path.cwd())  # Ray has put the files of the working directory here
        sys.path[:] = [folder for folder in sys.path if folder != here]
    try:
        _require_versions(call.versions)
    except KbotError as error:
        return Outcome(error=error)
    item = _moved(call.item, call.folder, here)
    (outcome,) = _pool.map(run_task, [item], seconds_of)
    if outcome is None:
        raise KeyboardInterrupt
    return replace(outcome, value=_moved(outcome.value, here, call.folder))


_pool = Pool(1)
"""The process in which the runs of this task are executed, one after the other."""


def _require_versions(versions: Mapping[str, str]) -> None:
    for name, wanted in versions.items():
        try:
            found = version(name)
        except PackageNotFoundError:
            found = "none"
        if found != wanted:
            machine = os.uname().nodename if hasattr(os, "uname") else "a machine"
            raise _WrongMachine(
                f"{machine} of the cluster has {name} {found}, not {wanted}, so that results could differ. "
                f"Install {name}=={wanted} there"
            )


def _moved(value: T, folder: str, target: str) -> T:
    """A value with the paths in `folder` replaced by those in `target`, also within its parts."""
    if folder == target:
        return value
    return cast("T", _replaced(value, folder, target))


def _replaced(value: object, folder: str, target: str) -> object:
    if isinstance(value, str):
        path = rf"(?<![\w.-]){re.escape(folder)}{_PATH_END}"
        return re.sub(path, lambda match: target, value) if folder in value else value
    if isinstance(value, tuple) and type(value) is tuple:
        return tuple(_replaced(each, folder, target) for each in value)
    if isinstance(value, dict):
        return {key: _replaced(each, folder, target) for key, each in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        found: dict[str, Any] = {
            field.name: getattr(value, field.name) for field in fields(value) if field.init
        }
        changed = {name: _replaced(each, folder, target) for name, each in found.items()}
        changed = {name: each for name, each in changed.items() if each is not found[name]}
        return replace(value, **changed) if changed else value
    return value


def _inside(folder: str) -> str:
    """A folder relative to the working directory. Empty if it is not inside."""
    path = Path(folder).resolve()
    here = Path.cwd().resolve()
    return str(path.relative_to(here)) if path != here and path.is_relative_to(here) else ""


def _require_answer(address: str) -> None:
    """Raises OSError: nothing answers at an address. Ray would try for minutes."""
    host, _, port = address.removeprefix("ray://").partition("?")[0].rpartition(":")
    if port.isdigit():
        socket.create_connection((host.strip("[]"), int(port)), CONNECT_SECONDS).close()


@contextmanager
def _without_stderr() -> Iterator[None]:
    """Within the block, what native code writes to stderr is lost."""
    try:
        saved = os.dup(2)
    except OSError:  # it is closed
        yield
        return
    try:
        with Path(os.devnull).open("wb") as nothing:
            os.dup2(nothing.fileno(), 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)


def _imported() -> ModuleType:
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # Ray reports to its makers by default
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")  # else it warns about graphics cards
    os.environ.setdefault("RAY_BACKEND_LOG_LEVEL", "fatal")  # lost nodes are handled here
    try:
        import ray  # an extra, and slow to import
    except ModuleNotFoundError:
        raise KbotError(needs_extra("--on ray", "ray")) from None
    # Ray has no option for this: it prints the log of each lost machine, although its runs are repeated
    ray._private.worker.print_to_stdstream = lambda *data, **options: None
    return ray


def _why(error: Exception, address: str) -> str:
    """Why a cluster cannot be used."""
    text = (
        _last_line(error) if isinstance(error, ModuleNotFoundError) else str(error).strip().partition("\n")[0]
    )
    if "size" in text.lower() and "exceed" in text.lower():
        return (
            f"the working directory is too large to be sent to the cluster: {text}. Run the command in the "
            "folder of the robot's package, or list what is not needed in the file .rayignore"
        )
    text = (error.strerror if isinstance(error, OSError) else None) or text
    where = "on this machine" if address == LOCAL else f"at {address}"
    return f"cannot use a Ray cluster {where}: {text or type(error).__name__}"


@contextmanager
def _connected() -> Iterator[None]:
    """Report the loss of the connection to a cluster. Raises KbotError: it is lost."""
    try:
        yield
    except Exception as error:  # noqa: BLE001 - Ray raises many kinds
        raise KbotError(_lost(error)) from None


def _lost(error: Exception) -> str:
    why = (error.strerror if isinstance(error, OSError) else None) or _last_line(error)
    return (
        f"the connection to the cluster was lost: {why}. Finished runs are kept. "
        "Run the same command again to continue"
    )


def _last_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__
