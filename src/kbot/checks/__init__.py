"""Checks of robot descriptions: a file in, findings out, each with its source line."""

from kbot.checks.config import Config
from kbot.checks.open_files import OpenFiles
from kbot.checks.registry import Finding, Rule, all_rules, find_rule, rule
from kbot.checks.runner import check_file, check_loaded, check_text
from kbot.checks.settings import load_config
from kbot.lazy_names import public_names

__all__ = [
    "Config",
    "Finding",
    "OpenFiles",
    "Rule",
    "all_rules",
    "check_file",
    "check_loaded",
    "check_text",
    "find_rule",
    "load_config",
    "rule",
]

__dir__ = public_names(__all__)
