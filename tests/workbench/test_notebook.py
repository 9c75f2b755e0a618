"""What a notebook is given of a robot: its page as HTML, and hardly any text."""

import kbot


def test_the_page_is_kept_once() -> None:
    shown = kbot.load("kbot").show()
    assert "<iframe" in shown._repr_html_()
    assert len(repr(shown)) < 100  # notebooks keep it beside the HTML, and a terminal prints it
