"""Why something happened in a run."""

from __future__ import annotations

from dataclasses import dataclass

from kbot.text import Origin, Related

LEAST_SHARE = 0.5
"""The share of an observation that a cause must explain at least. No other cause can then explain more."""


@dataclass(frozen=True, slots=True)
class Cause:
    """Why something happened, and where that is written.

    is_fault  whether the description is the reason. Otherwise the finding is an info
    is_limit  whether it is a limit of the drive, which explains a missed command, but no error of odometry
    """

    text: str
    origin: Origin | None = None
    hint: str = ""
    is_fault: bool = True
    related: tuple[Related, ...] = ()
    is_limit: bool = False


def unknown(what: str = "", hint: str = "") -> Cause:
    """No cause explains enough of the observation. `what` is what is known."""
    return Cause(f"{what}, and the cause is not known" if what else "the cause is not known", None, hint)


def percent(share: float) -> str:
    """A share as text, in whole per cent."""
    return f"{round(share * 100.0, 0) + 0.0:.0f} %"  # 0 and not -0
