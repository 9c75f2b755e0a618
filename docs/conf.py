"""Sphinx's settings for the documentation site. `build.py` copies the sources and builds it."""

import re
from importlib.metadata import version as version_of

from sphinx.application import Sphinx

project = "KBot"
author = copyright = "The KBot authors"
release = version = version_of("kbot")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "docs/index"

myst_heading_anchors = 4  # links to headings work as on GitHub
myst_links_external_new_tab = False

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = "KBot"
html_copy_source = False
html_show_copyright = False
html_theme_options = {"navigation_with_keys": True}
highlight_language = "none"  # a block without a language is plain text
pygments_style = "friendly"
pygments_dark_style = "github-dark"

suppress_warnings = ["docutils"]  # docstrings are plain text, not reStructuredText: it finds markup in them


def mark_code(
    _app: Sphinx, _what: str, _name: str, _object: object, _options: object, lines: list[str]
) -> None:
    """Turn the single backticks of docstrings into the double ones of reStructuredText."""
    text = re.sub(r"(?<!`)`([^`\n]+)`(?!`)", r"``\1``", "\n".join(lines))
    lines[:] = text.split("\n")


def setup(app: Sphinx) -> None:
    app.connect("autodoc-process-docstring", mark_code, priority=400)  # before napoleon
