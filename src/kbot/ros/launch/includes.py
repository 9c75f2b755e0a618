"""Limits on the includes of launch files: their depth, their number, and the work that they take together."""

from __future__ import annotations

from kbot.ros.launch.launch_error import LaunchError
from kbot.text import Source
from kbot.xacro.budget import Budget
from kbot.xacro.xacro_error import LimitFault

MOST_LEVELS = 64
MOST_FILES = 1000
"""Files that include each other twice double in number with each level: the depth alone does not end them."""


def require_end(path: str, levels: int, files: int) -> None:
    """Check that a file may be included at depth `levels`, after `files` other files.

    Raises:
        LaunchError: L070, a limit is exceeded.
    """
    is_deep = levels > MOST_LEVELS
    if is_deep or files >= MOST_FILES:
        bound = f"more than {MOST_LEVELS} levels deep" if is_deep else f"after {MOST_FILES:,} other files"
        raise LaunchError("L070", f"{path} is included {bound}", "check whether it includes itself")


_YAML_STEPS = 3
"""Steps for a character of YAML. PyYAML's Python loader takes 5 microseconds for each if values are short."""


def charge_file(budget: Budget, source: Source) -> None:
    """Charge the work of reading a file.

    Raises:
        LaunchError: L070, all files together are too large.
    """
    if source.path.endswith((".yaml", ".yml")):
        charge_yaml(budget, source.path, source.text)
    else:
        charge_text(budget, source.path, source.text)


def charge_yaml(budget: Budget, path: str, text: str) -> None:
    """Charge the work of reading the YAML of a file.

    Raises:
        LaunchError: L070, as `charge_file` does.
    """
    charge(budget, path, len(text) * _YAML_STEPS)


def charge_text(budget: Budget, path: str, text: str | bytes) -> None:
    """Charge the work of reading a file and storing its text: about a microsecond for 8 characters.

    Raises:
        LaunchError: L070, as `charge_file` does.
    """
    charge(budget, path, len(text) >> 3)


def charge(budget: Budget, path: str, steps: int, fault: str = "is too large") -> None:
    """Charge an amount of work for a file.

    Raises:
        LaunchError: L070, as `charge_file` does.
    """
    try:
        budget.charge(steps)
    except LimitFault:
        message = f"{path} {fault}, counted together with all files before it"
        raise LaunchError("L070", message, "split the launch file", is_limit=True) from None
