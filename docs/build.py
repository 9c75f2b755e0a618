"""Builds the documentation site: python docs/build.py [FOLDER]. The default folder is build/docs.

The sources are copied to a temporary folder, where KBot draws the pictures and writes the pages that it
generates from its own help and docstrings. The layout is that of the repository, so links work on GitHub too.
Every warning of Sphinx, such as a broken link, is an error.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path.insert(0, str(HERE))

from drawn_pictures import draw_pictures  # noqa: E402 - beside this file
from generated_pages import PAGES  # noqa: E402 - beside this file

SOURCES = (
    "docs",
    "examples",
    "benchmarks/README.md",
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "LICENSE",
)
IGNORED = shutil.ignore_patterns("__pycache__", ".ipynb_checkpoints")


def build(folder: Path) -> int:
    """Build the site in a folder. Returns Sphinx's exit status: 0 if there was no warning."""
    from sphinx.cmd.build import build_main  # imported lazily: it is in the extra 'docs'

    with tempfile.TemporaryDirectory() as temporary:
        stage = Path(temporary)
        for name in SOURCES:
            if (ROOT / name).is_dir():
                shutil.copytree(ROOT / name, stage / name, ignore=IGNORED)
            else:
                (stage / name).parent.mkdir(exist_ok=True)
                shutil.copy(ROOT / name, stage / name)
        draw_pictures(stage / "docs")
        for name, write in PAGES.items():
            (stage / "docs" / name).write_text(write(stage / "docs"), "utf-8")
        _show_examples(stage / "examples")
        _add_tables_of_contents(stage / "docs" / "index.md")
        words = ["-q", "-W", "--keep-going", "-c", str(stage / "docs"), "-d", str(stage / "doctrees")]
        status = build_main([*words, "-b", "html", str(stage), str(folder)])
    (folder / "index.html").write_text('<meta http-equiv="refresh" content="0; url=docs/index.html">\n')
    return status


def _add_tables_of_contents(index: Path) -> None:
    """Add Sphinx's tables of contents to the index, from its lists. On GitHub they would be code blocks."""
    head, *parts = re.split(r"^## (.*)\n", index.read_text("utf-8"), flags=re.MULTILINE)
    text = head
    for heading, part in zip(parts[::2], parts[1::2], strict=True):
        links = part.rstrip()
        if heading == "Reference":
            links += "".join(f"\n- [{_title(index.parent / name)}]({name})" for name in PAGES)
        pages = re.findall(r"^- \[.*?\]\((.*?)\.md\)", links, re.MULTILINE)
        contents = _toctree(pages, f":hidden:\n:titlesonly:\n:caption: {heading}")
        text += f"## {heading}\n{links}\n\n{contents}\n"
    index.write_text(text, "utf-8")


def _title(page: Path) -> str:
    return page.read_text("utf-8").partition("\n")[0].removeprefix("# ")


def _show_examples(folder: Path) -> None:
    """Show the code of each example below the table, and the pages of the longer ones in the contents."""
    page = folder / "README.md"
    programs = "".join(
        f"\n## {path.name}\n\n```{{literalinclude}} {path.name}\n:language: python\n```\n"
        for path in sorted(folder.glob("*.py"))
    )
    longer = [f"{path.parent.name}/README" for path in sorted(folder.glob("*/README.md"))]
    page.write_text(page.read_text("utf-8") + programs + "\n" + _toctree(longer, ":hidden:"), "utf-8")


def _toctree(pages: list[str], options: str) -> str:
    contents = "\n".join(pages)
    return f"```{{toctree}}\n{options}\n\n{contents}\n```\n"


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build" / "docs"
    status = build(target)
    if not status:
        print(f"the site is at {target / 'index.html'}")
    sys.exit(status)
