"""Cost of 20 tabs of a running simulation for the server, and the delay of one of them.

    python benchmarks/bench_tabs.py [--seconds S]

One tab is a real page in Chromium. The others are sockets that receive the same data as a page, including
odometry, and answer as a page does. The share of a core is the increase over the simulation without tabs. The
lag is the time from a request of the real page to the answer, while the other tabs are open.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from browsing import KEEP_SOCKET, SHOWS, answer_lag, kbot, opened_browser, page, share_of_core
from websockets.asyncio.client import connect

TABS = (1, 20)
BEAT, ACKNOWLEDGEMENT = '{"type":"beat"}', '{"type": "heard"}'
"""The server's periodic request for an acknowledgement, and a page's answer."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seconds", type=float, default=5.0)
    seconds = parser.parse_args().seconds
    with opened_browser() as browser, kbot(["sim", "kbot"]) as (address, process):
        time.sleep(1.0)
        alone = share_of_core(process.pid, seconds)
        with page(browser, address, f"{SHOWS} && window.line?.readyState === 1", KEEP_SOCKET) as shown:
            for tabs in TABS:
                with sockets(address, tabs - 1):
                    time.sleep(1.0)
                    share = share_of_core(process.pid, seconds) - alone
                    late = answer_lag(shown)
                print(
                    f"{tabs:2} tabs: {share:6.1%} of a core for the server, lag {late:.0f} ms (limit 100 ms)"
                )


@contextmanager
def sockets(address: str, count: int) -> Iterator[None]:
    """Sockets on a separate thread, each of which receives what a page receives."""
    loop = asyncio.new_event_loop()
    opened = threading.Barrier(2)

    async def receive() -> None:
        async with connect(address.replace("http:", "ws:") + "ws", max_size=None) as socket:
            await socket.send(json.dumps({"type": "subscribe", "topic": "/odom"}))
            async for message in socket:
                if message == BEAT:
                    await socket.send(ACKNOWLEDGEMENT)

    async def receive_all() -> None:
        tabs = [asyncio.create_task(receive()) for _ in range(count)]
        opened.wait()
        await asyncio.Event().wait() if not tabs else await asyncio.gather(*tabs)

    running = loop.create_task(receive_all())

    def run() -> None:
        with suppress(asyncio.CancelledError):
            loop.run_until_complete(running)
        for tab in asyncio.all_tasks(loop):
            with suppress(asyncio.CancelledError):
                loop.run_until_complete(tab)
        loop.close()

    thread = threading.Thread(target=run)
    thread.start()
    opened.wait()
    yield
    loop.call_soon_threadsafe(running.cancel)
    thread.join()


if __name__ == "__main__":
    main()
