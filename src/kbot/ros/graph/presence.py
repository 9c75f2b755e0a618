"""Finds the KBots that run on this machine: each keeps a small file while it can be queried."""

from __future__ import annotations

import json
import os
import socket
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from textwrap import shorten
from urllib.parse import urlsplit

from kbot.text import KbotError
from kbot.text.files import read_text
from kbot.text.json_text import parse_json
from kbot.text.temporary import private_folder, user_folder

CONNECT_SECONDS = 0.3
"""A KBot on this machine accepts a connection at once."""
_LARGEST_PID = 2**31 - 1
_LATEST = 32503680000.0
"""The year 3000: later start times are refused. `time.localtime` raises an error for much larger numbers."""
SHOWN = 48
"""Characters of a command line that are printed, so that an entry of the list fits in a line."""


@dataclass(frozen=True, slots=True)
class Presence:
    """A running KBot. `address` is the WebSocket address of its graph server, with the token."""

    pid: int
    address: str
    robot: str
    world: str

    command: str = ""
    """The command line that started it."""
    since: float = 0.0
    """When it was started, in seconds of the Unix epoch."""

    @property
    def is_valid(self) -> bool:
        """Whether the values can be those of a process. Another program may have written the file."""
        texts = (self.address, self.robot, self.world, self.command)
        return (
            all(isinstance(text, str) for text in texts)
            and type(self.pid) is int
            and 0 < self.pid <= _LARGEST_PID
            and isinstance(self.since, int | float)
            and 0 <= self.since <= _LATEST
        )

    def __str__(self) -> str:
        """One short line for the list of running KBots."""
        where = f" in '{Path(self.world).name}'" if self.world else ""
        since = f" since {time.strftime('%H:%M:%S', time.localtime(self.since))}" if self.since else ""
        command = f": {shorten(self.command, SHOWN, placeholder=' …')}" if self.command else ""
        return f"{self.robot}{where}{since}{command}"


def announce(presence: Presence) -> Path:
    """Write the file, readable only by this user. Raises OSError."""
    running()  # it deletes the files of killed KBots, which would stay if nobody asks for the running ones
    path = private_folder(_folder()) / f"{presence.pid}.json"
    path.unlink(missing_ok=True)
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w") as file:
        json.dump(asdict(presence), file)
    return path


def running() -> list[Presence]:
    """The KBots whose process is alive, oldest first. Files of dead processes are deleted.

    Raises:
        OSError: the folder of the files is a link or belongs to another user, who could write such files.
    """
    folder, found = _folder(), []
    if folder.exists():
        private_folder(folder)
    for path in sorted(folder.glob("*.json"), key=_age):
        try:
            presence = Presence(**parse_json(read_text(path)))
        except (KbotError, ValueError, TypeError):
            continue  # it is just being written, or it is a file of another kind
        if not presence.is_valid:
            continue
        if _is_alive(presence):
            found.append(presence)
        else:
            with suppress(OSError):
                path.unlink()
    return found


def find(at: str = "", how: str = "--at NUMBER") -> str:
    """The address of the running KBot, or of the one that `at` selects by process ID or address.

    `how` is what a user writes to select one; errors quote it.

    Raises:
        KbotError: no KBot runs, several run and `at` is empty, or `at` selects none of them.
    """
    if "://" in at:
        return at
    known = running()
    if not known:
        raise KbotError("no KBot is running. Start one in another terminal: kbot sim kbot")
    chosen = [presence for presence in known if not at or str(presence.pid) == at]
    listed = "".join(f"\n  {how.replace('NUMBER', str(presence.pid))}   {presence}" for presence in known)
    if not chosen:
        raise KbotError(f"no KBot with process ID {at} is running. Running KBots:{listed}")
    if len(chosen) > 1:
        raise KbotError(f"several KBots are running. Select one:{listed}")
    return chosen[0].address


def _folder() -> Path:
    given = os.environ.get("XDG_RUNTIME_DIR") or os.environ.get("LOCALAPPDATA")
    if given and Path(given).is_dir():
        return Path(given) / "kbot"
    return user_folder()


def _age(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _is_alive(presence: Presence) -> bool:
    if os.name == "nt":
        return answers(presence.address)  # on Windows os.kill with signal 0 ends the process
    try:
        os.kill(presence.pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True  # the process belongs to another user
    return True


def answers(address: str) -> bool:
    """Whether a server accepts connections at an address such as `ws://127.0.0.1:4711/?token=…`."""
    place = urlsplit(address)
    try:
        socket.create_connection((place.hostname or "", place.port or 0), CONNECT_SECONDS).close()
    except (OSError, ValueError):
        return False
    return True
