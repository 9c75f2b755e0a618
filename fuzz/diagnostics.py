"""Checks that diagnostics have a code, a message and a place, and that KBot can print them."""

from collections.abc import Sequence

from kbot.text import Diagnostic
from kbot.text.render import render_text, to_json


def check_diagnostics(diagnostics: Sequence[Diagnostic]) -> None:
    for diagnostic in diagnostics:
        assert diagnostic.code, diagnostic
        assert diagnostic.message, diagnostic
        assert diagnostic.origin is not None, diagnostic
        to_json(diagnostic)
    render_text(diagnostics)
