"""Expands xacro descriptions to URDF documents with a source map."""

from kbot.lazy_names import lazy_names, public_names
from kbot.xacro.engine import clear_cache, expand, expand_text
from kbot.xacro.limits import Limits
from kbot.xacro.result import Expansion

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.xacro.packages import AmbiguousPackage, PackageNotFound, Packages

__all__ = [
    "AmbiguousPackage",
    "Expansion",
    "Limits",
    "PackageNotFound",
    "Packages",
    "clear_cache",
    "expand",
    "expand_text",
]

__getattr__ = lazy_names(
    __name__, {"AmbiguousPackage": "packages", "PackageNotFound": "packages", "Packages": "packages"}
)
__dir__ = public_names(__all__)
