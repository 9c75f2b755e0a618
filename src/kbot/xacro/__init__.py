"""The xacro language: expands a description to a document with a source map."""

from kbot.xacro.engine import clear_cache, expand, expand_text
from kbot.xacro.limits import Limits
from kbot.xacro.result import Expansion

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.xacro.packages import PackageNotFound, Packages

__all__ = ["Expansion", "Limits", "PackageNotFound", "Packages", "clear_cache", "expand", "expand_text"]


def __getattr__(name: str) -> object:
    """Packages are imported when they are asked for: not every description has any."""
    if name in ("PackageNotFound", "Packages"):
        from kbot.xacro import packages  # lazy in this module: start-up time

        return getattr(packages, name)
    raise AttributeError(f"module 'kbot.xacro' has no attribute '{name}'")
