"""A static picture is not drawn repeatedly."""

from collections.abc import Callable
from typing import Any

from kbot.workbench.session.session import Session

from .conftest import until

OpenPage = Callable[..., Any]


def test_a_picture_is_drawn_only_while_something_moves(
    driving: tuple[str, Session], open_page: OpenPage
) -> None:
    page = open_page(driving[0])

    def drawn_in_half_a_second() -> int:
        frames, start = page.evaluate("[kbot.frames, kbot.time]")
        until(lambda: page.evaluate("kbot.time") > start + 0.5)
        return int(page.evaluate("kbot.frames")) - int(frames)

    until(lambda: drawn_in_half_a_second() == 0)  # after the robot has settled on its wheels
    page.keyboard.down("w")
    until(lambda: drawn_in_half_a_second() > 1)
    page.keyboard.up("w")
    until(lambda: drawn_in_half_a_second() == 0)
