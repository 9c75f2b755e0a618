"""The xacro language: a description goes in, an expanded document with a source map comes out."""

from kbot.xacro.engine import clear_cache, expand, expand_text
from kbot.xacro.limits import Limits
from kbot.xacro.packages import PackageNotFound, Packages
from kbot.xacro.result import Expansion

__all__ = ["Expansion", "Limits", "PackageNotFound", "Packages", "clear_cache", "expand", "expand_text"]
