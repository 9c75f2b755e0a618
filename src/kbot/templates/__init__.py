"""Templates of a new robot package."""

from kbot.templates.package import NewPackage, Sizes, check_name, make_package

__all__ = ["NewPackage", "Sizes", "check_name", "make_package"]
