"""The user's own programs: which run, with which interpreter and command line, and how they are ended."""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from kbot.ros.launch import Plan, read_launch, read_launch_2
from kbot.ros.launch.running.processes import Process, Processes
from kbot.ros.launch.running.programs import _parameter_words, command_line, environment
from kbot.ros.launch.staging import stage
from kbot.ros.launch.user_program import Program, find_program
from kbot.text import Diagnostic
from kbot.xacro import Packages


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "package.xml").write_text("<package><name>mine</name></package>")
    (tmp_path / "scripts").mkdir()
    return tmp_path


def program(folder: Path, text: str, name: str = "n.py", attributes: str = "") -> Program | Diagnostic:
    (folder / "scripts" / name).write_text(text)
    plan = plan_of(folder, f'<node pkg="mine" type="{name}" name="n" {attributes}/>')
    return find_program(plan.nodes[0], Packages(around=str(folder / "a.launch")))


def plan_of(folder: Path, body: str) -> Plan:
    file = folder / "a.launch"
    file.write_text(f"<launch>\n{body}\n</launch>\n")
    return read_launch(str(file)).require()


def test_program_that_needs_only_kbot_runs_with_this_python(folder: Path) -> None:
    found = program(folder, "import kbot\nimport math\n")
    assert isinstance(found, Program)
    assert (found.interpreter, found.file) == (sys.executable, str(folder / "scripts" / "n.py"))


def test_program_can_import_modules_of_its_folder(folder: Path) -> None:
    (folder / "scripts" / "helper.py").write_text("")
    assert isinstance(program(folder, "#!/usr/bin/env python3\nimport helper\n", "n"), Program)


def test_program_can_import_the_module_of_another_package(folder: Path) -> None:
    module = folder.parent / "tools" / "src" / "tools"
    module.mkdir(parents=True)
    (module / "__init__.py").write_text("")
    (folder.parent / "tools" / "package.xml").write_text("<package><name>tools</name></package>")
    found = program(folder, "from tools import x\n")
    assert isinstance(found, Program)
    assert environment(found)["PYTHONPATH"].split(os.pathsep)[0] == str(module.parent)


@pytest.mark.parametrize(
    ("text", "name", "why"),
    [
        ("import no_such_module_of_ros\n", "n.py", "imports no_such_module_of_ros, not installed"),
        ("\x7fELF", "n", "is not a Python program"),
        ("import (\n", "n.py", "n.py:1: not valid Python"),
    ],
)
def test_program_that_cannot_run_is_reported_at_its_line_with_the_reason(
    folder: Path, text: str, name: str, why: str
) -> None:
    found = program(folder, text, name)
    assert isinstance(found, Diagnostic)
    assert found.origin is not None
    assert (found.code, found.is_error, found.origin.span.line) == ("L055", False, 2)
    assert why in found.message


def test_required_program_that_cannot_run_is_an_error(folder: Path) -> None:
    found = program(folder, "import no_such_module_of_ros\n", attributes='required="true"')
    assert isinstance(found, Diagnostic)
    assert found.is_error


def test_node_without_a_program_is_reported(folder: Path) -> None:
    found = stage(plan_of(folder, '<node pkg="mine" type="missing" name="n"/>'))
    assert [note.code for note in found.notes] == ["L055"]
    assert "has no program missing" in found.notes[0].message


def test_command_line_is_that_of_roslaunch(folder: Path) -> None:
    (folder / "scripts" / "n.py").write_text("")
    plan = plan_of(
        folder,
        """<remap from="scan" to="/base/scan"/><env name="A" value="1"/>
        <node pkg="mine" type="n.py" name="n" ns="left" args="--fast 'a b'" launch-prefix="nice -n 5"/>""",
    )
    found = find_program(plan.nodes[0], Packages(around=plan.path))
    assert isinstance(found, Program)
    file = str(folder / "scripts" / "n.py")
    assert command_line(found, plan, "") == [
        *("nice", "-n", "5", sys.executable, file, "--fast", "a b", "scan:=/base/scan", "__name:=n"),
    ]
    env = environment(found)
    assert (env["A"], env["ROS_NAMESPACE"]) == ("1", "/left")


def test_command_line_is_that_of_ros2_launch(folder: Path) -> None:
    (folder / "scripts" / "n.py").write_text("")
    file = folder / "a.launch.xml"
    file.write_text(
        '<launch><node pkg="mine" exec="n.py" name="n" namespace="left" args="--fast">'
        '<remap from="scan" to="other"/></node></launch>'
    )
    plan = read_launch_2(str(file)).require()
    found = find_program(plan.nodes[0], Packages(around=plan.path))
    assert isinstance(found, Program)
    assert command_line(found, plan, "/p.yaml")[2:] == [
        *("--fast", "--ros-args", "-r", "__node:=n", "-r", "__ns:=/left", "-r", "scan:=other"),
        *("--params-file", "/p.yaml"),
    ]


def test_binary_parameters_are_not_on_the_command_line(folder: Path) -> None:
    data = folder / "data"
    data.write_bytes(b"\0")
    plan = plan_of(
        folder,
        f"""<node pkg="mine" type="n.py" name="n">
        <param name="size" value="2"/><param name="data" binfile="{data}"/></node>""",
    )
    assert _parameter_words(plan, plan.nodes[0]) == ["_size:=2"]


class Watch:
    """Runs small Python programs as processes and stores the reports."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.reports: list[str] = []
        self.failures: list[Diagnostic] = []
        self.ended = threading.Event()

    def process(self, name: str, code: str, **more: object) -> Process:
        return Process(
            f"/{name}",
            [sys.executable, "-c", code],
            dict(os.environ),
            str(self.folder),
            **more,
        )

    def run(self, *processes: Process) -> Processes:
        return Processes(processes, self.reports.append, self.ended.set, self.failures.append)


@pytest.fixture
def watch(tmp_path: Path) -> Watch:
    return Watch(tmp_path)


def until(condition: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end, f"no {what} after 60 s"
        time.sleep(0.02)


COUNT = "open('count', 'a').write('x')"


def test_respawned_process_is_restarted(watch: Watch) -> None:
    running = watch.run(watch.process("a", COUNT, respawn=0.0))
    count = watch.folder / "count"
    until(lambda: count.exists() and len(count.read_text()) >= 3, "third start")
    running.close()
    written = len(count.read_text())
    time.sleep(0.3)
    assert len(count.read_text()) == written
    assert any("is restarted" in text for text in watch.reports)


def test_process_without_respawn_runs_once(watch: Watch) -> None:
    running = watch.run(watch.process("a", COUNT))
    until(lambda: watch.reports == ["/a exited"], "exit")
    running.close()
    assert (watch.folder / "count").read_text() == "x"
    assert not watch.ended.is_set()


def test_exit_of_a_required_process_ends_the_launch(watch: Watch) -> None:
    running = watch.run(watch.process("a", "import sys; sys.exit(3)", required=True))
    assert watch.ended.wait(60)
    running.close()
    assert running.status == 1
    assert watch.reports == ["/a is required and exited with status 3: the launch ends"]


def test_output_of_a_process_is_in_its_log(watch: Watch) -> None:
    log = watch.folder / "a.log"
    running = watch.run(watch.process("a", "print('hello'); raise SystemExit(1)", log=log))
    until(lambda: bool(watch.reports), "exit")
    running.close()
    assert log.read_text() == "hello\n"
    assert watch.reports == [f"/a exited with status 1; its output is in {log}"]


def test_a_process_that_fails_is_one_finding_at_its_node(watch: Watch, folder: Path) -> None:
    node = plan_of(folder, '<node pkg="mine" type="n.py" name="n"/>').nodes[0]
    count = f"{COUNT}; raise SystemExit(2)"
    running = watch.run(watch.process("n", count, respawn=0.0, origin=node.origin), watch.process("good", ""))
    until(lambda: len(watch.reports) >= 4, "third failure")
    running.close()
    (failure,) = watch.failures
    assert (failure.code, failure.is_error, failure.origin) == ("L090", True, node.origin)
    assert failure.message == "/n exited with status 2"


def test_a_program_that_cannot_start_is_a_finding(watch: Watch) -> None:
    running = watch.run(Process("/a", ["/no/such/program"], {}, str(watch.folder)))
    until(lambda: bool(watch.reports), "report")
    running.close()
    assert [failure.message for failure in watch.failures] == watch.reports


def test_process_waits_for_the_exit_of_another(watch: Watch) -> None:
    order = "open('order', 'a').write('{}')"
    first = watch.process("first", f"import time; time.sleep(0.3); {order.format(1)}")
    second = watch.process("second", order.format(2), after=("exit", "/first"))
    running = watch.run(second, first)
    until(lambda: "/second exited" in watch.reports, "exit of the second")
    running.close()
    assert (watch.folder / "order").read_text() == "12"


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for other processes")
def test_ctrl_c_sends_sigint_to_the_process_and_its_children(watch: Watch) -> None:
    code = (
        "import subprocess, sys, time, pathlib\n"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'])\n"
        "try:\n"
        "    pathlib.Path('child').write_text(str(child.pid))\n"
        "    time.sleep(60)\n"
        "except KeyboardInterrupt: pathlib.Path('output').write_text('bye'); child.wait()\n"
    )
    running = watch.run(watch.process("a", code))
    until(lambda: (watch.folder / "child").exists() and (watch.folder / "child").read_text() != "", "child")
    running.close()
    assert (watch.folder / "output").read_text() == "bye"
    with pytest.raises(ProcessLookupError):
        os.kill(int((watch.folder / "child").read_text()), 0)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for other processes")
def test_process_that_ignores_signals_is_killed(watch: Watch, monkeypatch: pytest.MonkeyPatch) -> None:
    import kbot.ros.launch.running.processes as processes

    shorter = tuple((number, min(seconds, 0.3)) for number, seconds in processes._ENDINGS)
    monkeypatch.setattr(processes, "_ENDINGS", shorter)
    code = (
        "import signal, time, pathlib\n"
        "for number in (signal.SIGINT, signal.SIGTERM): signal.signal(number, signal.SIG_IGN)\n"
        "import os; pathlib.Path('pid').write_text(str(os.getpid()))\ntime.sleep(60)\n"
    )
    running = watch.run(watch.process("a", code))
    until(lambda: (watch.folder / "pid").exists() and (watch.folder / "pid").read_text() != "", "start")
    running.close()
    with pytest.raises(ProcessLookupError):
        os.kill(int((watch.folder / "pid").read_text()), 0)
    assert signal.SIGKILL == processes._KILL


def test_program_that_cannot_be_started_is_reported(watch: Watch) -> None:
    running = watch.run(Process("/a", ["/no/such/program"], {}, str(watch.folder)))
    until(lambda: bool(watch.reports), "report")
    running.close()
    assert watch.reports == ["/a cannot be started: No such file or directory"]
