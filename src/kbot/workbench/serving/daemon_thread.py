"""Run slow work on a thread that does not delay the end of KBot."""

from __future__ import annotations

import asyncio
import contextvars
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


async def on_daemon_thread(work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """Return the result of a function that runs on its own thread, with the context of the caller.

    Unlike asyncio.to_thread: the loop and the process end without waiting for it.
    """
    result: Future[T] = Future()
    result.set_running_or_notify_cancel()  # a thread cannot be stopped: it outlives its caller
    context = contextvars.copy_context()

    def run() -> None:
        try:
            result.set_result(context.run(work, *args, **kwargs))
        except BaseException as error:  # noqa: BLE001 - raised in the caller
            result.set_exception(error)

    threading.Thread(target=run, daemon=True, name="kbot-work").start()
    return await asyncio.wrap_future(result)
