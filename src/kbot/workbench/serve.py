"""Opens a session and serves it at an address."""

from __future__ import annotations

import asyncio
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from kbot.kinematics.planar_pose import PlanarPose
from kbot.model.load import resolve_robot_path
from kbot.workbench.address import Address, bound
from kbot.workbench.driving.sliders import Sliders, SliderSetting
from kbot.workbench.serving.server import Server
from kbot.workbench.session.session import Session
from kbot.workbench.source.description import DescriptionFile
from kbot.world import load_world

if TYPE_CHECKING:
    from kbot.workbench.driving.driving import Attend

ORIGIN = PlanarPose()


def open_session(
    path: str,
    *,
    simulate: bool,
    world: str = "empty",
    arguments: Mapping[str, str] | None = None,
    properties: Mapping[str, str] | None = None,
    seed: int = 0,
    contacts: str = "recipe",
    package_path: Sequence[str] = (),
    attend: Attend = lambda simulation: None,
    show: Callable[[Sliders], None] = lambda shown: None,
    start: PlanarPose = ORIGIN,
) -> Session:
    """Read a description (or `kbot`, the robot that ships) and make it ready to be shown or driven.
    `attend` is told of each simulation before it first moves, `show` of each robot that is only shown;
    `start` is where the robot stands at first.

    Raises:
        DescriptionError: it makes no robot; with everything that is wrong.
        KbotError: there is no such world.
    """
    description = DescriptionFile(resolve_robot_path(path), arguments, package_path, properties=properties)
    if simulate:
        # lazy in this module: it loads the engine
        from kbot.workbench.session.driven_session import driven_session

        return driven_session(description, load_world(world), world, seed, contacts, attend, start)
    setting = SliderSetting(attend=show)
    return Session(description, "view", lambda robot: Sliders(robot, setting=setting))


def serve_session(session: Session, address: Address) -> None:
    """Serve the workbench until Ctrl-C."""
    server = Server(session, address.access)
    with suppress(KeyboardInterrupt):
        asyncio.run(_run_until_ended(server, address.listening, _welcome(session, address.url)))
    _say("\n")


@contextmanager
def serving(session: Session, host: str = "127.0.0.1", port: int | None = 0) -> Iterator[str]:
    """Serve a session on a thread of its own; yields the address.

    Raises:
        KbotError: the address is taken or not this machine's.
    """
    with bound(host, port) as address:
        server = Server(session, address.access)
        loop = asyncio.new_event_loop()
        running = loop.create_task(server.run(address.listening))
        thread = threading.Thread(target=_run_until_cancelled, args=(loop, running), daemon=True)
        thread.start()
        try:
            yield address.url
        finally:
            loop.call_soon_threadsafe(running.cancel)
            thread.join()


def _run_until_cancelled(loop: asyncio.AbstractEventLoop, running: asyncio.Task[None]) -> None:
    asyncio.set_event_loop(loop)
    try:
        loop.run_until_complete(running)
    except asyncio.CancelledError:
        pass
    finally:
        for left in asyncio.all_tasks(loop):
            left.cancel()
            with suppress(asyncio.CancelledError):
                loop.run_until_complete(left)
        loop.run_until_complete(loop.shutdown_asyncgens())
        loop.run_until_complete(loop.shutdown_default_executor())
        loop.close()


def _welcome(session: Session, address: str) -> str:
    about = session.about()
    keys = (
        "Drive with W A S D or the arrow keys, held down; Space stops, P pauses, R resets."
        if about.mode == "sim" and not about.cannot_drive
        else f"It cannot drive: {about.cannot_drive}"
        if about.mode == "sim"
        else "P pauses and goes on; the line below the picture goes anywhere."
        if about.mode == "play"
        else "Move the sliders; save the file to see it change."
    )
    where = f" in the world '{about.world}'" if about.world else ""
    return f"{session.scene.robot}{where} is at  {address}\n{keys}  Ctrl-C here ends.\n"


def _say(text: str) -> None:
    sys.stdout.write(text)
    sys.stdout.flush()


async def _run_until_ended(server: Server, listening: socket.socket, welcome: str) -> None:
    """Serve until Ctrl-C or SIGTERM, which cancel the run in order where the loop can hear them."""
    loop = asyncio.get_running_loop()
    serving = loop.create_task(server.run(listening))
    for number in (signal.SIGINT, signal.SIGTERM):
        try:
            loop.add_signal_handler(number, serving.cancel)
        except (NotImplementedError, RuntimeError, ValueError):
            break  # Windows, or not the main thread: Ctrl-C raises KeyboardInterrupt
    _say(welcome)
    with suppress(asyncio.CancelledError):
        await serving
