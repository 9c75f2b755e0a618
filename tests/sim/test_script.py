"""A script's errors: file, line, code, and the user's own calls."""

import re
import sys
import threading
from pathlib import Path

import pytest

from kbot.messages.log import Log
from kbot.sim import Simulation
from kbot.sim.script import Script
from kbot.sim.script_errors import ScriptError, ScriptFailed
from kbot.text import KbotError


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def error_of(text: str) -> ScriptError:
    Path("drive.py").write_text(text)
    with pytest.raises(ScriptError) as caught:
        Script("drive.py").run(Simulation("kbot"))
    return caught.value


def test_an_error_lists_the_user_s_calls_with_their_code(folder: Path) -> None:
    (folder / "maths.py").write_text("def half(x):\n    return x / 0\n")
    error = error_of("import maths\n\ndef go(x):\n    return maths.half(x)\n\ndef drive(sim):\n    go(3)\n")
    assert str(error) == (
        "maths.py:2: ZeroDivisionError: division by zero\n"
        "    drive.py:7 in drive: go(3)\n"
        "    drive.py:4 in go: return maths.half(x)\n"
        "    return x / 0"
    )
    assert (Path(error.path).name, error.line) == ("maths.py", 2)


def test_an_error_of_kbot_is_at_the_line_that_called_it(folder: Path) -> None:
    error = error_of("def drive(sim):\n    sim.cmd_vel(0.1,\n        float('nan'))\n")
    assert str(error).startswith("drive.py:2: ")
    assert "KbotError" not in str(error)
    error = error_of("def drive(sim):\n    sim.robots['q']\n")
    assert str(error) == "drive.py:2: unknown robot 'q': choose from kbot\n    sim.robots['q']"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "def drive(sim:\n    pass\n",
            "drive.py:1: not valid Python: '(' was never closed\n    def drive(sim:",
        ),
        ("x = '\0'", "drive.py:1: not valid Python"),
        (
            "import nowhere\n",
            "drive.py:1: ModuleNotFoundError: No module named 'nowhere'\n    import nowhere",
        ),
        (
            "x = 1\ndef drive():\n    pass\n",
            "drive.py:2: drive must have one parameter, the",
        ),
        ("def drive(sim, robot):\n    pass\n", "drive.py:1: drive must have one parameter, the"),
        ("drive = 3\n", "drive.py:1: the script has no function drive(sim). Put the program into def drive("),
        ("", "drive.py:1: the script has no function drive(sim). Put the program into def drive(sim):"),
        (
            "x = 1\ndef Drive(sim):\n    pass\n",
            "drive.py:2: the script has no function drive(sim) (did you mean 'drive' instead of 'Drive'?)",
        ),
        ("def drive(sim):\n    raise ValueError\n", "drive.py:2: ValueError\n    raise ValueError"),
        ("def drive(sim):\n    drive(sim)\n", "drive.py:2: RecursionError: maximum recursion depth exceeded"),
    ],
)
def test_unusable_scripts(folder: Path, text: str, message: str) -> None:
    assert str(error_of(text)).startswith(message)


HOSTILE = """
class Own(BaseException):
    def __str__(self): raise ValueError("x")
class Odd:
    def __repr__(self): raise ValueError("y")
def drive(sim):
"""


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("    raise Own()", "Own: <Own: ValueError while writing it>"),
        ("    raise GeneratorExit", "GeneratorExit"),
        ("    odd = Odd()\n    assert odd is None", "odd = <Odd: ValueError while writing it>"),
        ("    import os\n    os.mkdir('x'); os.chdir('x'); os.rmdir('../x')\n    1 / 0", "ZeroDivisionError"),
    ],
)
def test_objects_that_cannot_be_written_are_no_fault_of_kbot(
    folder: Path, body: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    (folder / "drive.py").write_text(HOSTILE + body)
    with pytest.raises(ScriptError, match=re.escape(message)):
        Script(str(folder / "drive.py")).run(Simulation("kbot"))


def test_an_async_drive_is_refused(folder: Path) -> None:
    (folder / "drive.py").write_text("async def drive(sim):\n    assert False\n")
    with pytest.raises(ScriptError, match=r"drive\.py:1: drive is an async function"):
        Script(str(folder / "drive.py")).run(Simulation("kbot"))


def test_a_drive_that_yields_is_refused_because_no_line_of_it_has_run(folder: Path) -> None:
    error = error_of("x = 1\ndef drive(sim):\n    yield sim.run(1)\n")
    assert str(error) == "drive.py:2: drive is a generator, because it contains yield. Remove yield"
    error = error_of("async def drive(sim):\n    yield sim.run(1)\n")
    assert str(error).startswith("drive.py:1: drive is an async function")


def test_a_script_that_is_not_utf_8_is_reported_with_its_line(folder: Path) -> None:
    (folder / "drive.py").write_bytes(b"# first\n# f\xfcr alle\n")
    with pytest.raises(KbotError) as caught:
        Script("drive.py")
    assert str(caught.value) == (
        "drive.py is not UTF-8 text: byte 0xfc in line 2, at offset 11 (save it as UTF-8)"
    )


def test_two_threads_cannot_step_at_once() -> None:
    sim, refused = Simulation("kbot"), []

    def step(count: int) -> None:
        try:
            for _ in range(count):
                sim.run(1.0)
        except KbotError as error:
            refused.append(str(error))

    threads = [threading.Thread(target=step, args=(50,)) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert refused == ["another thread is stepping this simulation. Step it on one thread at a time"]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("sim.cmdvel(0.2, 0.0)", "object has no attribute 'cmdvel' (did you mean 'cmd_vel'?)"),
        ("speed = 0.2; sim.cmd_vel(sped, 0.0)", "name 'sped' is not defined (did you mean 'speed'?)"),
        ("prnt(sim.time)", "name 'prnt' is not defined (did you mean 'print'?)"),
        ("sim.fly()", "object has no attribute 'fly'"),
        ("sim.run(0,5)", "3 were given (write 0.5 with a point, not 0,5)"),
        ("sim.run(1.5, 2)", "3 were given"),
        ("sim.run(1,2,3)", "4 were given"),
        (
            "sim.add_sensor(Imu(link='base_link')).latest.orientation",
            "imu has no reading yet: advance the simulation first, for example with sim.run(0.012), or call"
            " measure()",
        ),
        ("None.orientation", "'NoneType' object has no attribute 'orientation'"),
    ],
)
def test_an_error_with_a_likely_cause_gets_a_suggestion(folder: Path, line: str, message: str) -> None:
    text = f"from kbot.sensors import Imu\ndef drive(sim):\n    {line}\n"
    assert str(error_of(text)).split("\n")[0].endswith(message)


def test_an_error_in_a_recursion_lists_only_the_last_calls(folder: Path) -> None:
    assert len(str(error_of("def drive(sim):\n    drive(sim)\n")).split("\n")) == 8


def test_a_module_that_is_not_python_is_reported_at_its_line(folder: Path) -> None:
    (folder / "maths.py").write_text("\ndef half(x:\n")
    assert "maths.py:2: not valid Python" in str(error_of("import maths\n"))


def test_an_assertion_in_a_function_is_reported_with_values_and_calls(folder: Path) -> None:
    error = error_of(
        "def check(speed):\n    assert speed < 0.1, 'too fast'\n\n"
        "def drive(sim):\n    sim.run(0.5)\n    check(0.2)\n"
    )
    assert isinstance(error, ScriptFailed)
    assert str(error) == (
        "drive.py:2: assertion failed at 0.500 s: speed < 0.1: too fast\n"
        "    speed = 0.2\n"
        "    drive.py:6 in drive: check(0.2)"
    )


def test_modules_beside_the_script_are_read_again_and_belong_to_its_files(folder: Path) -> None:
    maths, sim = folder / "maths.py", Simulation("kbot")
    Path("drive.py").write_text("import maths, json\n\ndef drive(sim):\n    assert maths.VALUE == 1\n")
    maths.write_text("VALUE = 1\n")
    script = Script("drive.py")
    script.run(sim)
    assert script.files == ("drive.py", str(maths))
    maths.write_text("VALUE = 2\n")
    with pytest.raises(ScriptFailed):
        script.run(sim)
    assert not (folder / "__pycache__").exists()
    assert str(folder) not in sys.path


def test_prints_are_published_with_the_error_and_reach_the_output(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sim, lines = Simulation("kbot"), list[Log]()
    sim.bus.subscribe("/log", Log, lines.append)
    Path("drive.py").write_text(
        "def drive(sim):\n    print('a', end='')\n    print('b\\nc', end='')\n    1 / 0\n"
    )
    with pytest.raises(ScriptError):
        Script("drive.py").run(sim)
    assert [line.msg for line in lines][:3] == ["ab", "c", "drive.py:4: ZeroDivisionError: division by zero"]
    assert [line.level for line in lines] == [20, 20, 40, 40]
    assert (lines[2].file, lines[2].line) == ("drive.py", 4)
    assert capsys.readouterr().out == "ab\nc"


def test_an_error_in_a_thread_of_the_script_is_the_script_s(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    others = list[threading.ExceptHookArgs]()
    monkeypatch.setattr(threading, "excepthook", others.append)
    Path("drive.py").write_text(
        "import threading\n\ndef work():\n    1 / 0\n\ndef drive(sim):\n"
        "    thread = threading.Thread(target=work)\n    thread.start()\n    thread.join()\n"
    )
    script = Script("drive.py")
    script.run(Simulation("kbot"))
    assert capsys.readouterr().err == (
        "error in a thread: drive.py:4: ZeroDivisionError: division by zero\n    1 / 0\n"
    )
    assert (script.has_failed_thread, others) == (True, [])
    thread = threading.Thread(target=int, args=("x",))  # not of the script
    thread.start()
    thread.join()
    assert [failed.exc_type for failed in others] == [ValueError]
    Path("drive.py").write_text("def drive(sim):\n    pass\n")
    script.run(Simulation("kbot"))
    assert not script.has_failed_thread


@pytest.mark.parametrize("code", ["", "0", "None"])
def test_a_script_may_end_with_sys_exit(folder: Path, code: str) -> None:
    Path("drive.py").write_text(f"import sys\ndef drive(sim):\n    sys.exit({code})\n")
    Script("drive.py").run(Simulation("kbot"))


def test_sys_exit_with_a_status_is_a_failure(folder: Path) -> None:
    error = error_of("import sys\ndef drive(sim):\n    sim.run(0.1)\n    sys.exit(3)\n")
    assert isinstance(error, ScriptFailed)
    assert str(error) == "drive.py:4: drive.py ended with sys.exit(3)\n    sys.exit(3)"
    assert (error.time, error.to_json()["message"]) == (0.1, "sys.exit(3)")


def test_a_missing_script_is_reported(folder: Path) -> None:
    with pytest.raises(KbotError, match=r"gone\.py does not exist"):
        Script("gone.py")
