"""What 20 tabs of a running simulation cost the server, and how late one of them is.

    python benchmarks/bench_tabs.py [--seconds S]

One tab is a real page in Chromium, the others are sockets that hear what a page is sent, odometry with it,
and answer as a page does. The share of a core is the server's beyond what the simulation takes with no tab
open. The lag is the real page's, beside the others: from a question that it sends to the answer.
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
BEAT, HEARD = '{"type":"beat"}', '{"type": "heard"}'
"""What the server asks now and then whether all was heard, and what a page answers."""


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
                    f"{tabs:2} tabs: {share:6.1%} of a core for the server, lag {late:.0f} ms (bound 100 ms)"
                )


@contextmanager
def sockets(address: str, count: int) -> Iterator[None]:
    """So many sockets on a thread of their own, each hearing what a page hears."""
    loop = asyncio.new_event_loop()
    opened = threading.Barrier(2)

    async def hear() -> None:
        async with connect(address.replace("http:", "ws:") + "ws", max_size=None) as socket:
            await socket.send(json.dumps({"type": "subscribe", "topic": "/odom"}))
            async for message in socket:
                if message == BEAT:
                    await socket.send(HEARD)

    async def all_of_them() -> None:
        tabs = [asyncio.create_task(hear()) for _ in range(count)]
        opened.wait()
        await asyncio.Event().wait() if not tabs else await asyncio.gather(*tabs)

    running = loop.create_task(all_of_them())

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
