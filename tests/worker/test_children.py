"""Children end with their parent, however it ends, and while they run no Python."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

import psutil
import pytest

from kbot.worker import children, job_object

SOON = 60
"""Seconds. A child ends within a second on an idle machine."""
HANG = "import ctypes; print(flush=True); ctypes.PyDLL(None).sleep(3600)"
"""A call in C that holds Python's lock: no thread and no handler runs."""
ON_POSIX = pytest.mark.skipif(os.name == "nt", reason="Windows has no process groups")
ON_LINUX = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has PR_SET_PDEATHSIG")


def wait_for_end(pid: int) -> None:
    with suppress(psutil.NoSuchProcess):
        psutil.Process(pid).wait(SOON)


PARENT = f"""
import subprocess, sys, threading, time
from kbot.worker import children
{{change}}
child = children.start([sys.executable, "-c", {HANG!r}], stdout=children.PIPE)
child.stdout.readline()
print(child.pid, flush=True)
{{then}}
"""
WITHOUT_SIGNAL = "children._BECOME = children._BECOME.replace('prctl', 'no_such_function')"
WITHOUT_GUARD = "children._GUARD = 'import sys; sys.stdin.read()'"


def pid_of_child(parent: subprocess.Popen[str]) -> int:
    assert parent.stdout is not None
    return int(parent.stdout.readline())


def started(change: str = "", then: str = "time.sleep(3600)") -> subprocess.Popen[str]:
    code = PARENT.format(change=change, then=then)
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)


@pytest.mark.parametrize(
    "change",
    [
        "",
        pytest.param(WITHOUT_SIGNAL, marks=ON_POSIX, id="the guard alone, as on macOS"),
        pytest.param(WITHOUT_GUARD, marks=ON_LINUX, id="the system alone"),
    ],
)
def test_a_child_in_a_c_call_ends_with_a_killed_parent(change: str) -> None:
    with started(change) as parent:
        pid = pid_of_child(parent)
        parent.kill()
    wait_for_end(pid)


@pytest.mark.parametrize("then", ["", "raise SystemExit(3)", "import os; os._exit(0)"])
def test_a_child_ends_with_a_parent_that_exits(then: str) -> None:
    with started(then=then) as parent:
        pid = pid_of_child(parent)
    wait_for_end(pid)


@ON_LINUX
def test_a_child_that_starts_after_its_parent_has_ended_does_not_run() -> None:
    """The kernel sends no signal for a parent that ended before the child asked. No process has the ID 0."""
    command = [*children._BARE, children._BECOME, "0", "1", "echo", "it ran"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "")


# The signal is sent again: a thread that is about to wait does not notice it.
INTERRUPTED = """
import os, signal, threading
import psutil
from kbot.worker import children
def once(*_):
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    raise KeyboardInterrupt
signal.signal(signal.SIGINT, once)
{how}
try:
    children.start(["sleep", "3600"])
except KeyboardInterrupt:
    is_interrupted.set()
    children._starter.call(lambda: children.Child(["true"])).wait()  # the thread has done what was before
    print([child.pid for child in psutil.Process().children()] == [children._guard._process.pid])
"""
BEFORE_IT_RUNS = """
is_interrupted, make = threading.Event(), children._guarded
def slow(start):
    children._guarded = make
    while not is_interrupted.wait(0.1):
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
    return make(start)
children._guarded = slow
"""
BEFORE_IT_REPORTS = """
is_interrupted = threading.Event()
children._BECOME = "import os, time\\nwhile True: os.kill(os.getppid(), 2); time.sleep(0.1)"
"""


@ON_LINUX
@pytest.mark.parametrize("how", [BEFORE_IT_RUNS, BEFORE_IT_REPORTS])
def test_ctrl_c_while_a_child_starts_ends_the_child(how: str) -> None:
    command = [sys.executable, "-c", INTERRUPTED.format(how=how)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=SOON)
    assert (done.stdout, done.stderr) == ("True\n", "")


@ON_LINUX
def test_a_child_outlives_the_thread_that_started_it() -> None:
    """The kernel sends the signal when the thread ends that called fork."""
    found: list[children.Child] = []
    thread = threading.Thread(target=lambda: found.append(children.start(["sleep", "3600"])))
    thread.start()
    thread.join()
    with pytest.raises(subprocess.TimeoutExpired):
        found[0].wait(0.3)
    found[0].end()


@ON_POSIX
def test_what_a_child_has_left_ends_with_the_parent() -> None:
    code = (
        "from kbot.worker import children\n"
        "child = children.start(['sh', '-c', 'sleep 3600 & echo $!'], stdout=children.PIPE)\n"
        "print(int(child.stdout.readline()), child.wait(), flush=True)\n"
        "input()\n"
    )
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", code], stdin=pipe, stdout=pipe, text=True) as parent:
        assert parent.stdout is not None
        pid, status = map(int, parent.stdout.readline().split())
        assert status == 0
        assert psutil.pid_exists(pid), "it may be a node that goes on in the background"
        parent.kill()
    wait_for_end(pid)


@ON_POSIX
def test_a_group_without_processes_is_forgotten() -> None:
    """Its ID may be that of other processes later."""
    child = children.start(["true"])
    assert child.wait() == 0
    assert child.pid not in children._guard._groups
    child.kill_all()


@ON_POSIX
def test_a_killed_guard_is_replaced() -> None:
    code = PARENT.format(
        change=f"{WITHOUT_SIGNAL}\nprint(children.start(['sleep', '3600']).pid, flush=True)\n"
        "children._guard._process.kill(); children._guard._process.wait()",
        then="time.sleep(3600)",
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as parent:
        pids = pid_of_child(parent), pid_of_child(parent)
        parent.kill()
    for pid in pids:
        wait_for_end(pid)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_fork_ends_its_own_children_only() -> None:
    code = PARENT.format(
        change="",
        then="import os\n"
        "if os.fork() == 0:\n"
        "    print(children.start(['sleep', '3600']).pid, flush=True)\n"
        "    sys.exit()\n"
        "os.wait()\n"
        "print(child.poll(), flush=True)\n"
        "time.sleep(3600)\n",
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as parent:
        own, of_fork = pid_of_child(parent), pid_of_child(parent)
        assert parent.stdout is not None
        assert parent.stdout.readline() == "None\n"
        wait_for_end(of_fork)
        assert psutil.pid_exists(own)
        parent.kill()
    wait_for_end(own)


@ON_POSIX
@pytest.mark.parametrize(
    ("words", "folder", "error"),
    [
        (["/no/such/program"], None, FileNotFoundError),
        (["no-such-program"], None, FileNotFoundError),
        (["true"], "/no/such/folder", FileNotFoundError),
        (["/etc"], None, PermissionError),
    ],
)
def test_a_program_that_cannot_be_started_raises_what_popen_raises(
    words: list[str], folder: str | None, error: type[OSError]
) -> None:
    with pytest.raises(error) as expected:
        subprocess.Popen(words, cwd=folder)
    with pytest.raises(error) as found:
        children.start(words, folder=folder)
    assert (found.value.errno, found.value.filename) == (expected.value.errno, expected.value.filename)


@ON_POSIX
def test_an_argument_that_no_program_can_have_is_refused() -> None:
    for _ in range(2):  # the thread that starts children goes on
        with pytest.raises(ValueError, match="null byte"):
            children.start(["true", "\0"])


@ON_POSIX
def test_a_program_without_a_format_is_refused_as_by_popen(tmp_path: Path) -> None:
    (tmp_path / "p").write_text("no #! line")
    (tmp_path / "p").chmod(0o755)
    with pytest.raises(OSError, match="Exec format error"):
        children.start([str(tmp_path / "p")])


@ON_LINUX
def test_a_program_has_the_signals_streams_and_environment_of_popen(tmp_path: Path) -> None:
    """Python ignores SIGPIPE: `yes | head` in a program would print an error, or never end."""
    words = ["sh", "-c", "grep -E 'Sig(Ign|Blk)' /proc/self/status; ls /proc/self/fd; env; pwd; cat"]
    environment = {"PATH": os.environ["PATH"], "A": "\udcff", "LC_ALL": "C"}
    expected = subprocess.run(
        words, cwd=tmp_path, env=environment, stdin=subprocess.DEVNULL, capture_output=True, check=True
    )
    found = children.run(words, folder=str(tmp_path), environment=environment)
    assert (found.returncode, found.stderr) == (0, b"")
    assert found.stdout == expected.stdout


@ON_POSIX
def test_a_program_that_takes_too_long_ends_with_what_it_started(tmp_path: Path) -> None:
    file = tmp_path / "pid"
    with pytest.raises(TimeoutError, match=r"after 0\.5 s"):
        children.run(["sh", "-c", f"sleep 3600 & echo $! > {file}; wait"], seconds=0.5)
    if file.exists():  # else the machine is slow, and it was killed before
        wait_for_end(int(file.read_text()))


@ON_LINUX
def test_a_program_has_no_more_memory_than_it_is_given() -> None:
    most = 300_000_000
    show = "import resource; print(resource.getrlimit(resource.RLIMIT_AS))"
    found = children.run([sys.executable, "-c", show], memory=most)
    assert found.stdout.decode() == f"({most}, {most})\n"
    again = f"from kbot.worker import children\nprint(children.run([{sys.executable!r}, '-c', {show!r}], "
    again += f"memory={2 * most}).stdout.decode(), end='')"
    nested = children.run([sys.executable, "-c", again], memory=most)
    assert (nested.stdout, nested.stderr) == (found.stdout, b""), "a program cannot raise its limit"
    full = children.run([sys.executable, "-c", f"bytes({most})"], memory=most)
    assert b"MemoryError" in full.stderr


@pytest.mark.skipif(ctypes.sizeof(ctypes.c_void_p) != 8, reason="the sizes are those of 64 bits")
def test_a_child_is_added_to_a_job_that_ends_with_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """The sizes and the numbers are those of Windows's header winnt.h, for 64 bits."""
    calls: list[tuple[object, ...]] = []

    class Kernel:
        def CreateJobObjectW(self, security: None, name: None) -> int:
            assert (security, name) == (None, None), "no other process can open it"
            return 0x1_0000_0007

        def SetInformationJobObject(self, job: ctypes.c_void_p, kind: int, limits: object, size: int) -> int:
            flags = bytes(limits._obj)[16:20]  # type: ignore[attr-defined]
            calls.append(("limit", job.value, kind, flags, size))
            return 1

        def OpenProcess(self, access: int, inherit: bool, pid: int) -> int | None:
            calls.append(("open", access, inherit, pid))
            return 0x9 if pid == 42 else None

        def AssignProcessToJobObject(self, job: ctypes.c_void_p, process: ctypes.c_void_p) -> int:
            calls.append(("assign", job.value, process.value))
            return 1

        def CloseHandle(self, handle: ctypes.c_void_p) -> int:
            calls.append(("close", handle.value))
            return 1

    kernel = Kernel()
    monkeypatch.setattr(job_object, "_kernel", lambda: kernel)
    job_object._job.cache_clear()
    try:
        job_object.add(42)
        job_object.add(43)  # it has ended
    finally:
        job_object._job.cache_clear()
    assert calls == [
        ("limit", 0x1_0000_0007, 9, b"\0\x20\0\0", 144),
        ("open", 0x101, False, 42),
        ("assign", 0x1_0000_0007, 0x9),
        ("close", 0x9),
        ("open", 0x101, False, 43),
    ]


@ON_POSIX
def test_a_signal_reaches_what_a_child_has_started() -> None:
    child = children.start(["sh", "-c", "sleep 3600 & echo $!; wait"], stdout=children.PIPE)
    assert child.stdout is not None
    pid = int(child.stdout.readline())
    child.signal_all(signal.SIGTERM)
    wait_for_end(pid)
    assert child.wait(SOON) == -signal.SIGTERM
    child.end()
