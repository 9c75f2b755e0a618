"""Memory of a long run, with a recording, a page, tabs and peers.

    python benchmarks/bench_soak.py [--minutes M] [--no-record]

A robot with a lidar drives in circles in real time, and all its topics are recorded. One real page in
Chromium, two sockets that receive and answer like pages, and a peer of each of three bridges (ROS 1,
Foxglove, rosbridge) are connected all the time. The page keeps the last five minutes of the run, so memory
grows until then. Afterwards it should stay the same. The memory is the resident set of KBot's process.
Exit status 1 if it grows by more than the limit.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import ExitStack, suppress
from pathlib import Path

import psutil
from bench_tabs import ACKNOWLEDGEMENT, BEAT
from bridge_peers import NAMES
from browsing import SHOWS, kbot, opened_browser, page
from websockets.asyncio.client import connect

from kbot.ros.bridges.ros1.rpc import call

HERE = Path(__file__).parent
BRIDGES = {"--ros1": "ROS 1:", "--foxglove": "Foxglove:", "--rosbridge": "rosbridge:"}
"""The options, and the beginning of the line in which KBot reports each address."""
SETTLED_MINUTES = 10
"""Until then, the kept five minutes fill up, and caches with them."""
LIMIT = 0.03
"""Growth per hour after that. Memory is allocated in large pieces, which alone are about one percent."""
TABS = 2


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--minutes", type=int, default=60)
    parser.add_argument("--no-record", action="store_true", help="Do not record the run.")
    options = parser.parse_args()
    minutes: int = options.minutes
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        reports, recording = folder / "reports", folder / "run.mcap"
        words = ["sim", "kbot", "lidar:=true", "--world", "boxes", *BRIDGES]
        if not options.no_record:
            words += ["--record", str(recording)]
        address, running = stack.enter_context(kbot(words, reports))
        browser = stack.enter_context(opened_browser())
        shown = stack.enter_context(page(browser, address, SHOWS))
        shown.set_viewport_size({"width": 320, "height": 240})  # large pictures only load the machine
        threading.Thread(target=asyncio.run, args=(receive_in_tabs(address),), daemon=True).start()
        for bridge, peer_address in addresses(reports).items():
            peer = [sys.executable, str(HERE / "bridge_peers.py"), bridge, peer_address]
            stack.callback(subprocess.Popen(peer, stdout=subprocess.DEVNULL).kill)
        process = psutil.Process(running.pid)
        megabytes: list[float] = []
        print("minute  memory (MB)  recording (MB)")
        for minute in range(minutes + 1):
            megabytes.append(process.memory_info().rss / 1e6)
            if minute % 5 == 0:
                recorded = recording.stat().st_size / 1e6 if recording.exists() else 0.0
                print(f"{minute:6}  {megabytes[-1]:11.1f}  {recorded:14.1f}", flush=True)
            time.sleep(60.0 if minute < minutes else 0.0)
    settled = megabytes[SETTLED_MINUTES:]
    if len(settled) < 2:
        return 0
    growth = (settled[-1] / settled[0] - 1.0) * 60.0 / (len(settled) - 1)
    print(f"growth per hour after {SETTLED_MINUTES} minutes: {growth:.1%} (limit {LIMIT:.0%})")
    return int(growth > LIMIT)


async def receive_in_tabs(address: str) -> None:
    """Receive what pages receive, and drive."""

    async def receive(number: int) -> None:
        async with connect(address.replace("http:", "ws:") + "ws", max_size=None) as socket:
            for name in NAMES:
                await socket.send(json.dumps({"type": "subscribe", "topic": f"/{name}"}))
            async for message in socket:
                if message == BEAT:
                    await socket.send(ACKNOWLEDGEMENT)
                    if number == 0:
                        await socket.send(json.dumps({"type": "drive", "linear": 0.2, "angular": 0.6}))

    with suppress(OSError):  # KBot has ended
        await asyncio.gather(*map(receive, range(TABS)))


def addresses(reports: Path) -> dict[str, str]:
    """The address of each bridge. For ROS 1, that of the publisher of /clock."""
    found: dict[str, str] = {}
    while len(found) < len(BRIDGES):
        time.sleep(0.1)
        for line in reports.read_text().splitlines():
            for option, beginning in BRIDGES.items():
                if beginning in line:
                    found[option.removeprefix("--")] = line.split()[-1]
    node = call(found["ros1"], "lookupNode", "/peer", "/kbot")
    _, host, port = call(node, "requestTopic", "/peer", "/clock", [["TCPROS"]])
    return {**found, "ros1": f"{host}:{port}"}


if __name__ == "__main__":
    sys.exit(main())
