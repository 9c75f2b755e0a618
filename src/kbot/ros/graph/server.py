"""Serves queries of `kbot topic`, `kbot param` and others: rosbridge with a token."""

from __future__ import annotations

import os
import secrets
import shlex
import sys
import time
from contextlib import suppress
from pathlib import Path

from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.rosbridge.bridge import RosbridgeBridge
from kbot.ros.graph.presence import Presence, announce


class GraphServer(RosbridgeBridge):
    """Rosbridge on this machine alone, on any free port; numbers that JSON lacks are sent as Python reads
    and writes them."""

    def __init__(self, link: PeerLink) -> None:
        """Raises KbotError: no port is free."""
        super().__init__(link, port=0, token=secrets.token_urlsafe(18), exact=True)
        self._file: Path | None = None

    def announce(self, robot: str, world: str) -> None:
        """Let it be found; where no file can be written it is there unannounced."""
        with suppress(OSError):
            command = shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])
            presence = Presence(os.getpid(), self.address, robot, world, command, time.time())
            self._file = announce(presence)

    def close(self) -> None:
        if self._file is not None:
            self._file.unlink(missing_ok=True)
        super().close()
