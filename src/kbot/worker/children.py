"""Starts the processes of KBot. All of them end with this process, however it ends.

SIGKILL runs no handler, and a child in a long C call runs no thread that could watch its parent. So the
system and another process end the children:

- Linux sends each child SIGKILL when its parent has ended: PR_SET_PDEATHSIG in prctl(2).
- On Linux and macOS, a guard process ends what a child has started too. It holds one end of a pipe, which the
  system closes at the end of this process. Each child leads a process group, and the guard kills the groups.
- On Windows, the children are in a job object, which the system closes (`worker/job_object.py`).
"""

from __future__ import annotations

import atexit
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import IO, Any

PIPE, DEVNULL, STDOUT = subprocess.PIPE, subprocess.DEVNULL, subprocess.STDOUT
_Stream = int | IO[bytes] | None
"""As `Popen` takes it. None: the stream of this process."""

_NEW_GROUP: int = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)

# Python's modules for this would run code between fork and exec, which can hang in a process with threads
# (preexec_fn in the documentation of subprocess). So a new Python asks, and then becomes the program.
_BECOME = """
import os, signal, sys
parent, report, words = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3:]
try:
    import ctypes
    ctypes.CDLL(None).prctl(1, ctypes.c_ulong(signal.SIGKILL))  # 1 is PR_SET_PDEATHSIG
except (ImportError, OSError, AttributeError):
    pass  # the guard remains
if os.getppid() != parent:  # it had ended before
    os._exit(1)
for number in (signal.SIGPIPE, signal.SIGXFSZ):  # which Python ignores
    signal.signal(number, signal.SIG_DFL)
os.set_inheritable(report, False)  # so that the program closes it
try:
    os.execvp(words[0], words)
except OSError as error:
    os.write(report, b"%d" % error.errno)
"""
_LIMIT = """
import resource
_, most = resource.getrlimit(resource.RLIMIT_AS)
memory = {memory} if most == resource.RLIM_INFINITY else min({memory}, most)  # nobody may raise the maximum
resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
"""
"""Before `_BECOME`. The program keeps the limit."""
_GUARD = """
import os, signal, sys
groups = set()
for line in sys.stdin:
    group = int(line)
    groups.add(group) if group > 0 else groups.discard(-group)
for group in groups:
    try:
        os.killpg(group, signal.SIGKILL)
    except OSError:
        pass
"""
_BARE = (sys.executable, "-I", "-S", "-c")
"""Python without the user's settings and packages, which starts in 10 ms."""
_CLOSE_SECONDS = 10.0
"""Seconds that the guard has to end. It waits for ever if a library forks this process without Python."""


class Child(subprocess.Popen[bytes]):
    """A process that KBot started. It leads a process group with all that it starts."""

    _is_guarded = False

    def poll(self) -> int | None:
        status = super().poll()
        self._forget(status)
        return status

    def wait(self, timeout: float | None = None) -> int:
        status = super().wait(timeout)
        self._forget(status)
        return status

    def _forget(self, status: int | None) -> None:
        """The system may reuse the ID of a process that has ended, but not while others are in its group."""
        if status is not None and self._is_guarded and sys.platform != "win32":
            try:
                os.killpg(self.pid, 0)
            except ProcessLookupError:
                self._is_guarded = False
                _guard.forget(self.pid)
            except PermissionError:
                pass  # what is left runs as another user

    def signal_all(self, number: int) -> None:
        """Send a signal to the process and all that it started. On Windows, only to the process."""
        with suppress(OSError):  # they have ended
            if sys.platform == "win32":
                self.send_signal(number)
            elif self._is_guarded:  # else the number may be that of others
                os.killpg(self.pid, number)

    def kill_all(self) -> None:
        """Kill the process with all that it started. They would keep its pipes open."""
        self.signal_all(getattr(signal, "SIGKILL", signal.SIGTERM))

    def end(self) -> None:
        """Kill the process with all that it started, and close its pipes."""
        self.kill_all()
        self.wait()
        for stream in (self.stdin, self.stdout, self.stderr):
            if stream is not None:
                with suppress(OSError):  # what was not sent yet
                    stream.close()


def start(
    command: Sequence[str],
    *,
    environment: Mapping[str, str] | None = None,
    folder: str | None = None,
    stdin: _Stream = DEVNULL,
    stdout: _Stream = DEVNULL,
    stderr: _Stream = None,
    memory: int | None = None,
) -> Child:
    """Start a program. The default environment and working directory are those of this process.

    `memory` limits the bytes of the program's address space (RLIMIT_AS in setrlimit(2)), on Linux only:
    elsewhere the program starts at once, without a Python before it that could set the limit.

    Ctrl-C in the terminal does not reach the program: this process decides what ends.

    Raises:
        OSError: the program cannot be started.
    """
    streams: dict[str, Any] = {"stdin": stdin, "stdout": stdout, "stderr": stderr}
    options = {"env": environment, "cwd": folder, **streams}
    if sys.platform == "win32":
        from kbot.worker import job_object  # slow to import: ctypes

        child = Child(command, creationflags=_NEW_GROUP, **options)
        job_object.add(child.pid)
        return child
    if sys.platform != "linux":
        return _guarded(lambda: Child(command, start_new_session=True, **options))
    reader, writer = os.pipe()
    with os.fdopen(reader, "rb") as report:
        try:
            become = _BECOME if memory is None else _LIMIT.format(memory=memory) + _BECOME
            words = [*_BARE, become, str(os.getpid()), str(writer), *command]
            child = _starter.call(
                lambda: _guarded(lambda: Child(words, start_new_session=True, pass_fds=(writer,), **options))
            )
        finally:
            os.close(writer)
        try:
            if code := report.read():  # nothing, as soon as the program runs
                raise OSError(int(code), os.strerror(int(code)), command[0])
        except BaseException:  # also Ctrl-C, after which nobody would end it
            child.end()
            raise
    return child


def run(
    command: Sequence[str],
    *,
    environment: Mapping[str, str] | None = None,
    folder: str | None = None,
    seconds: float | None = None,
    memory: int | None = None,
) -> subprocess.CompletedProcess[bytes]:
    """Run a program without input, and return its status and outputs. `memory` is as in `start`.

    Raises:
        OSError: the program cannot be started.
        TimeoutError: it has not ended after some seconds. It was killed, with all that it started.
    """
    with start(
        command, environment=environment, folder=folder, stdout=PIPE, stderr=PIPE, memory=memory
    ) as child:
        try:
            out, err = child.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            child.kill_all()
            raise TimeoutError(f"it has not ended after {seconds:g} s") from None
        except BaseException:
            child.kill_all()
            raise
    return subprocess.CompletedProcess(command, child.returncode, out, err)


def _guarded(make: Callable[[], Child]) -> Child:
    """Start a child. The guard is there before it."""
    _guard.open()
    child = make()
    child._is_guarded = True
    _guard.add(child.pid)
    return child


class _Guard:
    """The process that kills the groups of children at the end of this process."""

    def __init__(self) -> None:
        self._groups: set[int] = set()
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.RLock()  # a signal's handler may end a child while the lock is held

    def open(self) -> None:
        with self._lock:
            if self._process is None or self._process.poll() is not None:
                self._process = subprocess.Popen(
                    [*_BARE, _GUARD],
                    stdin=PIPE,
                    stdout=DEVNULL,
                    stderr=DEVNULL,
                    bufsize=0,  # a buffer has a lock, which a fork would copy
                    cwd="/",  # the user may delete the working directory
                    start_new_session=True,  # it must outlive Ctrl-C
                )
                atexit.unregister(self.close)
                atexit.register(self.close)
                for group in self._groups:  # someone killed the guard before
                    self._write(group)

    def add(self, group: int) -> None:
        with self._lock:
            self._groups.add(group)
            self._write(group)

    def forget(self, group: int) -> None:
        with self._lock:
            self._groups.discard(group)
            self._write(-group)

    def _write(self, number: int) -> None:
        stream = self._process.stdin if self._process is not None else None
        if stream is not None:
            with suppress(OSError, ValueError):  # it was killed, or is closed
                stream.write(b"%d\n" % number)

    def close(self) -> None:
        """Kill what is left, and wait until it is done."""
        with self._lock:
            if self._process is not None:
                if self._process.stdin is not None:
                    self._process.stdin.close()
                try:
                    self._process.wait(_CLOSE_SECONDS)
                except subprocess.TimeoutExpired:
                    self._process.kill()

    def leave(self) -> None:
        """Leave the guard to the parent of this process, which is a fork."""
        if self._process is not None and self._process.stdin is not None:
            with suppress(OSError):
                self._process.stdin.close()
            self._process.returncode = 0  # this process cannot wait for it


class _Order:
    """A child that the thread of `_Starter` starts for another thread."""

    def __init__(self, make: Callable[[], Child]) -> None:
        self._make = make
        self._made: Child | BaseException | None = None
        self._is_done = threading.Event()
        self._is_wanted = True

    def start(self) -> None:
        try:
            self._made = self._make()
        except BaseException as error:  # noqa: BLE001 - raised in the thread that asked
            self._made = error
        self._is_done.set()
        if not self._is_wanted:
            self._end()

    def result(self) -> Child:
        """The child, as soon as it is started. After Ctrl-C nobody would end it, so this does."""
        try:
            self._is_done.wait()
            if isinstance(self._made, BaseException):
                raise self._made
            assert self._made is not None
            return self._made
        except BaseException:
            self._is_wanted = False
            self._end()
            raise

    def _end(self) -> None:
        if isinstance(self._made, Child):
            self._made.end()


class _Starter:
    """A thread that starts all children and never ends.

    Linux kills a child at the end of the thread that started it, not of the process.
    """

    def __init__(self) -> None:
        self._orders: queue.SimpleQueue[_Order] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def call(self, make: Callable[[], Child]) -> Child:
        with self._lock:
            if self._thread is None:
                thread = threading.Thread(target=self._work, daemon=True, name="kbot-children")
                thread.start()
                self._thread = thread
        order = _Order(make)
        self._orders.put(order)
        return order.result()

    def _work(self) -> None:
        while True:
            self._orders.get().start()


_guard, _starter = _Guard(), _Starter()


def _begin_as_fork() -> None:
    """In a fork, the thread does not run, and the children and their guard are those of the parent."""
    # a thread of the parent may hold a lock of the old ones
    global _guard, _starter
    _guard.leave()
    atexit.unregister(_guard.close)
    _guard, _starter = _Guard(), _Starter()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_begin_as_fork)
