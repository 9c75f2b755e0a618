"""Limits on the includes of launch files: their depth, and their cost together."""

from __future__ import annotations

from kbot.ros.launch.launch_error import LaunchError
from kbot.text import Source
from kbot.xacro.budget import Budget
from kbot.xacro.xacro_error import LimitFault

MOST_LEVELS = 64
MOST_FILES = 1000


def require_end(path: str, levels: int, files: int) -> None:
    """Check that a file may be included so many levels deep, after so many others.

    Raises:
        LaunchError: L070, it may not.
    """
    is_deep = levels > MOST_LEVELS
    if is_deep or files >= MOST_FILES:
        bound = f"more than {MOST_LEVELS} levels deep" if is_deep else f"after {MOST_FILES:,} others"
        raise LaunchError("L070", f"{path} is included {bound}", "does it include itself?")


_YAML_STEPS = 3
"""Of a character of YAML: PyYAML's loader in Python takes 5 microseconds for each where values are short."""


def charge_file(budget: Budget, source: Source) -> None:
    """Charge reading a file.

    Raises:
        LaunchError: L070, the files are too large together.
    """
    if source.path.endswith((".yaml", ".yml")):
        charge_yaml(budget, source.path, source.text)
    else:
        charge_text(budget, source.path, source.text)


def charge_yaml(budget: Budget, path: str, text: str) -> None:
    """Charge reading YAML of a file.

    Raises:
        LaunchError: L070, as `charge_file` does.
    """
    charge(budget, path, len(text) * _YAML_STEPS)


def charge_text(budget: Budget, path: str, text: str | bytes) -> None:
    """Charge reading a file, and keeping its text: about a microsecond for 8 characters.

    Raises:
        LaunchError: L070, as `charge_file` does.
    """
    charge(budget, path, len(text) >> 3)


def charge(budget: Budget, path: str, steps: int, fault: str = "is too large") -> None:
    """Charge the work that a file takes.

    Raises:
        LaunchError: L070, as `charge_file` does.
    """
    try:
        budget.charge(steps)
    except LimitFault:
        message = f"{path} {fault}, with all files read before it"
        raise LaunchError("L070", message, "split the launch file", is_limit=True) from None
