"""`kbot sim FILE --script PY` in a process of its own: its script runs on the process's main thread."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection, connect

from .conftest import until

needs_signals = pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for one process")


class Run:
    """A running process, and what it has printed so far."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.out: list[str] = []
        self.err: list[str] = []
        self._readers = [
            threading.Thread(target=lambda: self.out.extend(iter(process.stdout.readline, ""))),
            threading.Thread(target=lambda: self.err.extend(iter(process.stderr.readline, ""))),
        ]
        for reader in self._readers:
            reader.start()

    @property
    def url(self) -> str:
        return until(lambda: re.search(r"http://\S+", "".join(self.out)))[0]

    def printed(self, text: str) -> bool:
        return text in "".join(self.out)

    def reported(self, text: str) -> bool:
        return text in "".join(self.err)

    def interrupt(self) -> int:
        """Press Ctrl-C and wait. Returns the exit status."""
        self.process.send_signal(signal.SIGINT)
        status = self.process.wait(60)
        for reader in self._readers:
            reader.join()
        return status


@contextmanager
def running(*words: str | Path, cwd: Path) -> Iterator[Run]:
    """Run Python with these words."""
    with subprocess.Popen(
        [sys.executable, "-u", *map(str, words)],
        cwd=cwd,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        run = Run(process)
        try:
            yield run
        finally:
            if process.poll() is None:
                process.kill()


@contextmanager
def scripted(script: Path, *words: str) -> Iterator[Run]:
    """Serve the shipped robot, driven by a script, without opening a browser."""
    command = ("-m", "kbot", "sim", "kbot", "--script", script.name, "--no-browser", "--port", "0", *words)
    with running(*command, cwd=script.parent) as run:
        yield run


class Watcher:
    """A page without a browser, which remembers the newest message of each kind."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection
        self.newest: dict[str, dict[str, Any]] = {}
        self.refused: list[str] = []
        self.closed: int | None = None
        """The code with which the server has closed the connection."""
        self._thread = threading.Thread(target=self._receive)
        self._thread.start()

    def send(self, kind: str, **fields: object) -> None:
        self._connection.send(json.dumps({"type": kind, **fields}))

    @property
    def phase(self) -> str:
        return str(self.newest.get("program", {}).get("phase"))

    @property
    def time(self) -> float:
        return float(self.newest.get("state", {}).get("time", -1.0))

    def close(self) -> None:
        self._connection.close()
        self._thread.join()

    def _receive(self) -> None:
        for data in self._connection:
            if not isinstance(data, str):
                continue
            message = json.loads(data)
            if message["type"] == "refused":
                self.refused.append(message["reason"])
            key = message["topic"] if message["type"] == "message" else message["type"]
            self.newest[key] = message
        self.closed = self._connection.close_code


@contextmanager
def watching(url: str) -> Iterator[Watcher]:
    with connect(url.replace("http:", "ws:").rstrip("/") + "/ws", max_size=None) as connection:
        watcher = Watcher(connection)
        try:
            yield watcher
        finally:
            watcher.close()
