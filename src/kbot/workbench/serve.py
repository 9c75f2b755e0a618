"""Open a session and serve it at an address."""

from __future__ import annotations

import asyncio
import socket
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from kbot.kinematics.planar_pose import PlanarPose
from kbot.model.load import resolve_robot_path
from kbot.text.files import read_source
from kbot.text.signals import ending_signals
from kbot.workbench.address import Address, bound
from kbot.workbench.driving.sliders import Sliders, SliderSetting
from kbot.workbench.serving.server import Server
from kbot.workbench.session.session import Session
from kbot.workbench.source.description_file import DescriptionFile
from kbot.world import load_world

if TYPE_CHECKING:
    from kbot.workbench.driving.driving import OnStart


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
    on_start: OnStart = lambda simulation: None,
    on_show: Callable[[Sliders], None] = lambda sliders: None,
    start: PlanarPose | None = None,
) -> Session:
    """Read a description (or `kbot`, the robot that ships) and prepare it to be displayed or driven.

    `on_start` is called with each simulation before it first moves, `on_show` with each robot that is only
    displayed. `start` is as for `Simulation`.

    If it does not describe a usable robot, the session has findings but no robot until a saved version does.

    Raises:
        DescriptionError: the file is missing, not readable, too large, or not text.
        KbotError: there is no such world.
    """
    file = resolve_robot_path(path)
    read_source(file)
    description = DescriptionFile(file, arguments, package_path, properties=properties)
    if simulate:
        # imported lazily: it loads the engine
        from kbot.workbench.session.driven_session import driven_session

        return driven_session(description, load_world(world), world, seed, contacts, on_start, start)
    setting = SliderSetting(on_start=on_show)
    return Session(description, "view", lambda robot: Sliders(robot, setting=setting))


def serve_session(session: Session, address: Address) -> None:
    """Serve the workbench until Ctrl-C."""
    server = Server(session, address.access)
    with suppress(KeyboardInterrupt):
        asyncio.run(_run_until_ended(server, address.listening, _welcome(session, address.url)))
    print_at_once("\n")


@contextmanager
def serving(session: Session, host: str = "127.0.0.1", port: int | None = 0) -> Iterator[str]:
    """Serve a session on its own thread. Yields the address.

    Raises:
        KbotError: the address is in use or not this machine's.
    """
    with bound(host, port) as address, served_at(session, address):
        yield address.url


@contextmanager
def served_at(session: Session, address: Address) -> Iterator[None]:
    """Serve a session at a bound address, on its own thread."""
    server = Server(session, address.access)
    loop = asyncio.new_event_loop()
    running = loop.create_task(server.run(address.listening))
    thread = threading.Thread(target=_run_until_cancelled, args=(loop, running), daemon=True)
    thread.start()
    try:
        yield
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
    if not session.shown.has_robot:
        return (
            f"{session.shown.file} does not describe a robot yet. The page is at  {address}\n"
            "The robot appears when you save a version without errors.  Ctrl-C here stops KBot.\n"
        )
    keys = (
        "Drive with W A S D or the arrow keys, held down; Space stops, P pauses, R resets."
        if about.mode == "sim" and not about.cannot_drive
        else f"It cannot drive: {about.cannot_drive}"
        if about.mode == "sim"
        else "P pauses and continues; the timeline below the picture goes to any time."
        if about.mode == "play"
        else "Move the sliders; save the file to see its changes."
    )
    where = f" in the world '{about.world}'" if about.world else ""
    return f"{session.scene.robot}{where} is at  {address}\n{keys}  Ctrl-C here stops KBot.\n"


def print_at_once(text: str) -> None:
    """Write to the terminal, also if the output is a pipe that buffers."""
    sys.stdout.write(text)
    sys.stdout.flush()


async def _run_until_ended(server: Server, listening: socket.socket, welcome: str) -> None:
    """Serve until a signal ends KBot, which cancels the run cleanly if the loop can handle signals."""
    loop = asyncio.get_running_loop()
    serving = loop.create_task(server.run(listening))
    for number in ending_signals():
        try:
            loop.add_signal_handler(number, serving.cancel)
        except (NotImplementedError, RuntimeError, ValueError):
            break  # on Windows and outside the main thread, Ctrl-C raises KeyboardInterrupt instead
    print_at_once(welcome)
    with suppress(asyncio.CancelledError):
        await serving
