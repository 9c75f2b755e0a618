"""Serves the queries of `kbot topic`, `node`, `service`, `param` and `tf`: rosbridge with a token."""

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
    """A rosbridge server for this machine only, on any free port.

    It sends NaN and infinity, which JSON lacks, as Python's `json` writes them.
    """

    def __init__(self, link: PeerLink, client: str = "") -> None:
        """`client` is the source of its clients' messages at the link. Raises KbotError: no port is free."""
        super().__init__(link, port=0, token=secrets.token_urlsafe(18), exact=True, client=client)
        self._file: Path | None = None

    def announce(self, robot: str, world: str) -> None:
        """Write the file by which clients find this server. If that fails, clients cannot find it."""
        with suppress(OSError):
            command = shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])
            presence = Presence(os.getpid(), self.address, robot, world, command, time.time())
            self._file = announce(presence)

    def close(self) -> None:
        if self._file is not None:
            self._file.unlink(missing_ok=True)
        super().close()
