"""What benchmarks of the page share: a browser, pages in it, what it takes, and a bare page of three.js."""

from __future__ import annotations

import functools
import http.server
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

WEB = Path(__file__).parents[1] / "web"
ARGUMENTS = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync")
SHOWS = "!!window.kbot && kbot.frames > 0 && kbot.revision > 0"
"""Whether the workbench has drawn."""
KEEP_SOCKET = (
    "window.WebSocket = class extends WebSocket { constructor(...a) { super(...a); window.line = this; } };"
)
"""A script that has the page's socket at hand, for `answer_lag`."""
ASK = """(text) => new Promise((resolve) => {
  const start = performance.now();
  const hear = ({ data }) => {
    if (typeof data !== 'string' || !data.includes(text)) return;
    line.removeEventListener('message', hear);
    resolve(performance.now() - start);
  };
  line.addEventListener('message', hear);
  line.send(JSON.stringify({ type: 'open_source', file: text })); })"""
QUESTIONS = 15
DRAWING = ("--type=renderer", "--type=gpu-process")
"""The processes of Chromium that scripts and pictures are made in."""


@contextmanager
def opened_browser() -> Iterator[Browser]:
    """Chromium without a window, drawing in software."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=list(ARGUMENTS))
        yield browser
        browser.close()


def chromium() -> str:
    names = (os.environ.get("KBOT_CHROMIUM"), "chromium", "chromium-browser", "google-chrome")
    found = next((path for name in names if name and (path := shutil.which(name))), None)
    return found or sys.exit("there is no Chromium (install one, or set KBOT_CHROMIUM to its path)")


@contextmanager
def page(browser: Browser, address: str, ready: str, first: str = "") -> Iterator[Page]:
    """A page once an expression in it holds; the script `first` runs before those of the page."""
    shown = browser.new_page(viewport={"width": 1280, "height": 720})
    shown.add_init_script(first)
    shown.goto(address)
    while not shown.evaluate(ready):
        time.sleep(0.01)
    yield shown
    shown.close()


def answer_lag(shown: Page) -> float:
    """Milliseconds from a page's question to the server's answer, the median of some; see `KEEP_SOCKET`."""
    return statistics.median(float(shown.evaluate(ASK, f"question {i}.")) for i in range(QUESTIONS))


@contextmanager
def kbot(words: list[str]) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """The address that a command of KBot serves at, and its process."""
    command = [sys.executable, "-m", "kbot", *words, "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        line = running.stdout.readline()
        while "http://" not in line:
            if running.poll() is not None:
                sys.exit(f"kbot {' '.join(words)} ended with {running.returncode}")
            line = running.stdout.readline()
        try:
            yield "http://" + line.split("http://")[1].split()[0], running
        finally:
            running.terminate()


@contextmanager
def bare_page(script: str) -> Iterator[str]:
    """Address of a page that has this script and nothing else, bundled as the workbench's is."""
    with tempfile.TemporaryDirectory(dir=WEB / "node_modules", prefix="bare-") as folder:
        (Path(folder) / "main.js").write_text(script)
        tag = '<body style="margin:0"><script type="module" src="./main.js"></script>'
        (Path(folder) / "index.html").write_text(f'<!doctype html><link rel="icon" href="data:,">{tag}')
        vite = str(WEB / "node_modules" / ".bin" / "vite")
        subprocess.run(
            [vite, "build", folder, "--logLevel", "error", "--base", "./"], check=True, cwd=WEB, stdout=2
        )
        handler = functools.partial(Quiet, directory=str(Path(folder) / "dist"))
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            try:
                yield f"http://127.0.0.1:{server.server_port}/"
            finally:
                server.shutdown()


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        pass


def share_of_core(pid: int, seconds: float) -> float:
    """How much of a core a process takes during the next seconds."""
    before = cpu_seconds(pid)
    time.sleep(seconds)
    return (cpu_seconds(pid) - before) / seconds


def cpu_seconds(pid: int) -> float:
    """Processor time of all threads that a process has now; those of one that is gone count as none."""
    nanoseconds = 0
    for thread in Path(f"/proc/{pid}/task").glob("*/schedstat"):
        try:
            nanoseconds += int(thread.read_text().split()[0])
        except OSError:  # it has just ended
            continue
    return nanoseconds / 1e9


def tree_seconds(pid: int) -> float:
    """Processor time of a process and of all that it started, with those of them that have ended."""
    tick = os.sysconf("SC_CLK_TCK")
    ticks = 0
    for one in (pid, *_descendants(pid)):
        try:
            words = Path(f"/proc/{one}/stat").read_text().rpartition(")")[2].split()
        except OSError:  # it has just ended
            continue
        ticks += sum(map(int, words[11:15]))  # of itself and of children waited for: utime to cstime
    return ticks / tick


def drawing_seconds() -> float:
    """Processor time of the browser's drawing processes, which other work on the machine hardly changes."""
    return sum(cpu_seconds(pid) for pid in _descendants(os.getpid()) if _draws(pid))


def settle() -> None:
    """Waits until the browser has nothing left to draw or to clear away, as of a page closed just before."""
    before, now = -1.0, drawing_seconds()
    while now != before:
        time.sleep(0.2)
        before, now = now, drawing_seconds()


def _draws(pid: int) -> bool:
    try:
        words = Path(f"/proc/{pid}/cmdline").read_text(errors="replace")
    except OSError:
        return False
    return any(kind in words for kind in DRAWING)


def _descendants(pid: int) -> set[int]:
    children: dict[int, list[int]] = {}
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(entry.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
        children.setdefault(parent, []).append(int(entry.parent.name))
    found: set[int] = set()
    waiting = [pid]
    while waiting:
        below = children.get(waiting.pop(), [])
        found.update(below)
        waiting += below
    return found
