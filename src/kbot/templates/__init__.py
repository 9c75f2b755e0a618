"""Templates of a new robot package."""

from kbot.templates.package import Sizes, check_name, make_package

__all__ = ["Sizes", "check_name", "make_package"]
