"""Templates of a new robot package."""

from kbot.lazy_names import public_names
from kbot.templates.package import NewPackage, Sizes, check_name, make_package

__all__ = ["NewPackage", "Sizes", "check_name", "make_package"]

__dir__ = public_names(__all__)
