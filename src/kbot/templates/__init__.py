"""Templates of a new robot package."""

from kbot.templates.package import Made, Sizes, check_name, make_package

__all__ = ["Made", "Sizes", "check_name", "make_package"]
