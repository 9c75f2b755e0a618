"""Shared by the page benchmarks: the browser, pages in it, processor time, and a bare three.js page."""

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
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

CHROMIUMS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
WEB = Path(__file__).parents[1] / "web"
ARGUMENTS = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync")
SHOWS = "!!window.kbot && kbot.frames > 0 && kbot.revision > 0"
"""Is true once the workbench has drawn."""
KEEP_SOCKET = (
    "window.WebSocket = class extends WebSocket { constructor(...a) { super(...a); window.line = this; } };"
)
"""A script that stores the page's socket in `window.line`, for `answer_lag`."""
ASK = """(text) => new Promise((resolve) => {
  const start = performance.now();
  const receive = ({ data }) => {
    if (typeof data !== 'string' || !data.includes(text)) return;
    line.removeEventListener('message', receive);
    resolve(performance.now() - start);
  };
  line.addEventListener('message', receive);
  line.send(JSON.stringify({ type: 'open_source', file: text })); })"""
QUESTIONS = 15
DRAWING = ("--type=renderer", "--type=gpu-process")
"""The Chromium processes that run scripts and render pictures."""


@contextmanager
def opened_browser() -> Iterator[Browser]:
    """Headless Chromium with software rendering."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=list(ARGUMENTS))
        yield browser
        browser.close()


def chromium() -> str:
    names = (os.environ.get("KBOT_CHROMIUM"), *CHROMIUMS)
    found = next((path for name in names if name and (path := shutil.which(name))), None)
    return found or sys.exit("Chromium is not found. Install it, or set KBOT_CHROMIUM to its path.")


@contextmanager
def page(browser: Browser, address: str, ready: str, first: str = "") -> Iterator[Page]:
    """Open a page and wait until an expression in it is true. The script `first` runs before the page's
    own."""
    shown = browser.new_page(viewport={"width": 1280, "height": 720})
    shown.add_init_script(first)
    shown.goto(address)
    while not shown.evaluate(ready):
        time.sleep(0.01)
    yield shown
    shown.close()


def answer_lag(shown: Page) -> float:
    """Median time from a request of a page to the server's answer, in ms. The page needs `KEEP_SOCKET`."""
    return statistics.median(float(shown.evaluate(ASK, f"question {i}.")) for i in range(QUESTIONS))


@contextmanager
def kbot(words: list[str], reports: Path | None = None) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Start a KBot command that serves; yields its address and process. stderr goes to `reports`."""
    command = [sys.executable, "-m", "kbot", *words, "--no-browser", "--port", "0"]
    with ExitStack() as stack:
        errors = stack.enter_context(reports.open("w")) if reports is not None else None
        running = stack.enter_context(
            subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True)
        )
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
    """The address of a page with only this script, bundled like the workbench."""
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
    """The share of a core that a process uses during the next seconds."""
    before = cpu_seconds(pid)
    time.sleep(seconds)
    return (cpu_seconds(pid) - before) / seconds


def cpu_seconds(pid: int) -> float:
    """Processor time of all threads of a process, in s. Threads that have ended do not count."""
    nanoseconds = 0
    for thread in Path(f"/proc/{pid}/task").glob("*/schedstat"):
        try:
            nanoseconds += int(thread.read_text().split()[0])
        except OSError:  # the thread or process has just ended
            continue
    return nanoseconds / 1e9


def tree_seconds(pid: int) -> float:
    """Processor time of a process and of all its descendants, including those that have ended, in s."""
    tick = os.sysconf("SC_CLK_TCK")
    ticks = 0
    for process in (pid, *_descendants(pid)):
        try:
            words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        except OSError:  # the thread or process has just ended
            continue
        ticks += sum(map(int, words[11:15]))  # utime to cstime: of the process and of children it waited for
    return ticks / tick


def drawing_seconds() -> float:
    """Processor time of the browser's renderer and GPU processes. Other load on the machine hardly changes
    it."""
    return sum(cpu_seconds(pid) for pid in _descendants(os.getpid()) if _draws(pid))


def settle() -> None:
    """Wait until the browser is idle, for example after a page was closed."""
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
