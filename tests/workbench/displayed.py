"""A page with displays, and what its picture shows at places of the world."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from kbot.messages import Header, Point, Pose, Quaternion
from kbot.workbench.serve import open_session

from .conftest import until
from .pictures import screenshot
from .served import Speaker, served

OpenPage = Callable[..., Any]

WORLD = Header(frame_id="world")
FROM_ABOVE = "kbot.look([0, -0.001, 3], [0, 0, 0])"

NOT_RECEIVED = ("no message received", "no topic", "does not exist", "loading", "off")
"""Parts of the statuses of a display that has not drawn a message yet."""

ASIDE = "document.querySelectorAll('.toolbar, .tools').forEach((e) => (e.style.display = 'none'))"
"""Takes away what lies over a small picture."""


class Show:
    """A page whose simulation is paused at its start. It displays only what a test adds."""

    def __init__(self, page: Any, bus: Speaker) -> None:
        self.page, self.bus = page, bus

    def add(self, kind: str, topic: str = "") -> None:
        choice = f"{kind} {topic}".strip()
        chooser = self.page.get_by_label("Add a display")
        until(lambda: chooser.locator(f"option[value='{choice}']").count())
        chooser.select_option(choice)
        row = self.row(kind)
        until(lambda: row.locator(".head[aria-expanded=true]").count())
        until(lambda: row.locator(".lamp[aria-label]").count())  # its first status, which `publish` reads

    def row(self, kind: str) -> Any:
        return self.page.locator(f".display[data-display={kind}]").last

    def field(self, kind: str, name: str) -> Any:
        return self.row(kind).locator(f"[data-property={name}]").locator("input, select").first

    def set(self, kind: str, name: str, value: str) -> None:
        field = self.field(kind, name)
        if field.evaluate("e => e.tagName") == "SELECT":
            until(lambda: field.locator(f"option[value='{value}']").count())
            field.select_option(value)
        else:
            field.fill(value)
            field.press("Tab")

    def status(self, kind: str) -> str:
        return str(self.row(kind).locator(".lamp").get_attribute("aria-label"))

    def publish(self, kind: str, topic: str, message: object) -> None:
        """Publish until the page shows that it has received the message."""

        def is_received() -> bool:
            self.bus.publish(topic, message)
            status = self.status(kind)  # read once, because it may change meanwhile
            return not any(words in status for words in NOT_RECEIVED)

        until(is_received)
        self.page.evaluate("kbot.drawn()")

    def look(self, eye: tuple[float, float, float], at: tuple[float, float, float]) -> None:
        self.page.evaluate(f"kbot.look({list(eye)}, {list(at)})")

    def pixels(self, points: Any) -> np.ndarray:
        """Return row and column (n, 2) of each point (n, 3) of the world."""
        camera = self.page.evaluate("kbot.camera()")
        clip = np.array(camera["clipFromWorld"]).reshape(4, 4)
        seen = (
            np.column_stack([np.asarray(points, float).reshape(-1, 3), np.ones(np.size(points) // 3)])
            @ clip.T
        )
        ndc = seen[:, :2] / seen[:, 3:]
        columns = (ndc[:, 0] + 1) / 2 * camera["width"]
        rows = (1 - ndc[:, 1]) / 2 * camera["height"]
        return np.stack([rows, columns], axis=1).astype(int)

    def colours(self, *points: tuple[float, float, float]) -> np.ndarray:
        """Return the colours at places of the world, (n, 3) in 0..255."""
        at = self.pixels(points)
        return screenshot(self.page)[at[:, 0], at[:, 1]].astype(int)

    def mask(self, rgb: tuple[int, int, int], within: int = 40) -> np.ndarray:
        """Return where the picture has approximately a colour, (height, width)."""
        result: np.ndarray = np.abs(screenshot(self.page).astype(int) - rgb).max(axis=2) < within
        return result

    def extent(self, mask: np.ndarray) -> np.ndarray:
        """Return the lowest and highest row and column of a mask, (2, 2)."""
        found = np.argwhere(mask)
        return np.array([found.min(axis=0), found.max(axis=0)])


@contextmanager
def showing(
    open_page: OpenPage, topics: dict[str, type], world: str = "empty", **options: Any
) -> Iterator[Show]:
    """Open a page of a paused simulation with topics that a test publishes on.

    Only the floor is displayed, without lines and without the robot.
    """
    session = open_session("kbot", simulate=True, world=world, **options)
    session.paused = True
    bus = session.topics.bus
    for topic, kind in topics.items():
        bus.advertise(topic, kind)
    with served(session) as address:
        page = open_page(address, color_scheme="dark", viewport={"width": 1180, "height": 480})
        page.evaluate(ASIDE)
        show = Show(page, Speaker(session))
        for kind in ("Grid", "RobotModel", "World"):
            if kind != "World" or world != "empty":  # the list leaves out displays with nothing to show
                page.get_by_label(f"Show {kind}", exact=True).uncheck()
        page.keyboard.press("0")  # the same for LaserScan
        yield show


def pose(x: float = 0.0, y: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> Pose:
    return Pose(Point(x, y, z), Quaternion(0.0, 0.0, float(np.sin(yaw / 2)), float(np.cos(yaw / 2))))


def is_like(colours: np.ndarray, rgb: tuple[int, int, int], within: int = 40) -> bool:
    return bool((np.abs(colours - rgb) < within).all())


def is_red(colours: np.ndarray) -> np.ndarray:
    result: np.ndarray = (colours[:, 0] > 70) & (colours[:, 0] > 1.6 * colours[:, 1:].max(axis=1))
    return result
