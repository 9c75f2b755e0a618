"""Opening the workbench: a session, an address, a browser."""

from __future__ import annotations

import asyncio
import secrets
import signal
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from os import environ
from typing import TYPE_CHECKING

from kbot.bridges.hosts import is_loopback
from kbot.kinematics.odometry import PlanarPose
from kbot.text import KbotError
from kbot.workbench.displays.files import DisplayFile
from kbot.workbench.serving.access import Access, bracketed
from kbot.workbench.serving.server import Server
from kbot.workbench.session.session import Session

if TYPE_CHECKING:
    from kbot.workbench.driving.driving import Attend
    from kbot.workbench.driving.sliders import Sliders
    from kbot.workbench.playback.playback import Playback

ORIGIN = PlanarPose()
SILENTLY = nullcontext()
FIRST_PORT, LAST_PORT = 8300, 8399
SEND_BUFFER = 64 * 1024


def open_session(
    path: str,
    *,
    simulate: bool,
    world: str = "empty",
    arguments: Mapping[str, str] | None = None,
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
    from kbot.model.load import resolve_robot_path
    from kbot.workbench.source.description import Description

    description = Description(resolve_robot_path(path), arguments, package_path)
    if simulate:
        from kbot.workbench.session.driven_session import driven_session

        return driven_session(description, world, seed, contacts, attend, start)
    from kbot.workbench.driving.sliders import Sliders, SliderSetting

    setting = SliderSetting(attend=show)
    return Session(description, "view", lambda robot: Sliders(robot, setting=setting))


def serve(
    path: str,
    *,
    simulate: bool,
    world: str = "empty",
    arguments: Mapping[str, str] | None = None,
    host: str = "127.0.0.1",
    port: int | None = None,
    open_browser: bool = True,
    seed: int = 0,
    contacts: str = "recipe",
    package_path: Sequence[str] = (),
    attend: Attend = lambda simulation: None,
    show: Callable[[Sliders], None] = lambda shown: None,
    start: PlanarPose = ORIGIN,
    config: str = "",
    opening: AbstractContextManager[None] = SILENTLY,
) -> None:
    """Serve the workbench until Ctrl-C. `port` None takes the first free one from 8300 on, 0 any.

    Where `host` is reached from other machines the address carries a token, which the page needs. `config` is
    the file that sets the displays. `opening` is entered while the session is made.

    Raises:
        DescriptionError, KbotError: as `open_session`; or the address is taken or not this machine's.
    """
    displays = read_displays(config)
    with opening:
        session = open_session(
            path,
            simulate=simulate,
            world=world,
            arguments=arguments,
            seed=seed,
            contacts=contacts,
            package_path=package_path,
            attend=attend,
            show=show,
            start=start,
        )
    session.display_file = displays
    serve_session(session, host=host, port=port, open_browser=open_browser)


def serve_recording(
    path: str,
    *,
    host: str,
    port: int | None,
    open_browser: bool,
    package_path: Sequence[str],
    config: str,
    show: Callable[[Playback], None],
    opening: AbstractContextManager[None] = SILENTLY,
) -> None:
    """As `serve`, for a recording that is played; where a browser is opened, from when its page is there.

    Raises:
        DescriptionError: the recording's description makes no robot.
        KbotError: no such recording, or it does not hold what is needed to show it; or as `serve`.
    """
    from kbot.workbench.session.played_session import played_session

    displays = read_displays(config)
    with opening:
        session = played_session(path, package_path, show)
    session.display_file = displays
    session.paused = session.waits_for_page = open_browser
    if session.note:
        sys.stderr.write(f"{session.note}\n")
    serve_session(session, host=host, port=port, open_browser=open_browser)


def read_displays(config: str) -> DisplayFile:
    """The file that sets the displays, empty for none; what of it is not shown is said on standard error.

    Raises:
        KbotError: it is of another kind, cannot be read, or is malformed; with file:line.
    """
    displays = DisplayFile(config)
    for note in displays.greeting.notes if displays.greeting is not None else ():
        sys.stderr.write(f"{config}: {note}\n")
    return displays


def serve_session(session: Session, *, host: str, port: int | None, open_browser: bool) -> None:
    """As `serve`, for a session that is open already.

    Raises:
        KbotError: the address is taken or not this machine's.
    """
    with bind(host, port) as listening:
        server, address = _server(session, host, listening)

        def ready() -> None:
            _say(_welcome(session, address))
            if open_browser and _has_display():
                threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()

        with suppress(KeyboardInterrupt):
            asyncio.run(_run_until_ended(server, listening, ready))
        _say("\n")


@contextmanager
def serving(session: Session, host: str = "127.0.0.1", port: int | None = 0) -> Iterator[str]:
    """Serve a session on a thread of its own; yields the address.

    Raises:
        KbotError: the address is taken or not this machine's.
    """
    with bind(host, port) as listening:
        server, address = _server(session, host, listening)
        loop = asyncio.new_event_loop()
        running = loop.create_task(server.run(listening))
        thread = threading.Thread(target=_run_until_cancelled, args=(loop, running), daemon=True)
        thread.start()
        try:
            yield address
        finally:
            loop.call_soon_threadsafe(running.cancel)
            thread.join()


def bind(host: str, port: int | None) -> socket.socket:
    """A listening socket.

    Raises:
        KbotError: every port asked for is in use, or the address is not this machine's.
    """
    ports = range(FIRST_PORT, LAST_PORT + 1) if port is None else (port,)
    try:
        family = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][0]
    except (OSError, UnicodeError):
        raise KbotError(f"--host {host}: no such address") from None
    for candidate in ports:
        try:
            listening = socket.create_server((host, candidate), family=family)
            # inherited by each connection: little is under way to a page that reads slowly
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
            return listening
        except PermissionError:
            if port is None:
                continue  # Windows keeps some of them for itself
            raise KbotError(f"--port {candidate} may not be served on without more rights") from None
        except OSError as error:
            if not _is_taken(error):
                raise KbotError(f"--host {host} cannot be served on: {error.strerror}") from None
    if port is None:
        raise KbotError(f"the ports {FIRST_PORT} to {LAST_PORT} are all in use; name another with --port")
    raise KbotError(f"port {port} is in use; name another with --port, or leave it out to get a free one")


def _is_taken(error: OSError) -> bool:
    import errno

    return error.errno in (errno.EADDRINUSE, errno.EACCES)


def _server(session: Session, host: str, listening: socket.socket) -> tuple[Server, str]:
    port = listening.getsockname()[1]
    token = None if is_loopback(host) else secrets.token_urlsafe(18)
    address = f"http://{bracketed(host)}:{port}/" + (f"?token={token}" if token else "")
    return Server(session, Access(host, port, token)), address


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


def _has_display() -> bool:
    """Whether a browser could open a window; without one `webbrowser` may take over the terminal."""
    if sys.platform.startswith("linux"):
        return bool(environ.get("DISPLAY") or environ.get("WAYLAND_DISPLAY"))
    return True


async def _run_until_ended(server: Server, listening: socket.socket, ready: Callable[[], None]) -> None:
    """Serve until Ctrl-C or SIGTERM, which cancel the run in order where the loop can hear them."""
    loop = asyncio.get_running_loop()
    serving = loop.create_task(server.run(listening))
    for number in (signal.SIGINT, signal.SIGTERM):
        try:
            loop.add_signal_handler(number, serving.cancel)
        except (NotImplementedError, RuntimeError, ValueError):
            break  # Windows, or not the main thread: Ctrl-C raises KeyboardInterrupt
    ready()
    with suppress(asyncio.CancelledError):
        await serving
