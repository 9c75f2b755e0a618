"""What the pages claim: links between files, commands and options, examples in Python, and topics."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from kbot.cli.main import group, run

from .pages import DOCS, ROOT, blocks, programs, sections

PAGES = sorted(
    [*DOCS.rglob("*.md"), *(ROOT / "examples").rglob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
)
TEXTS = {path: path.read_text("utf-8") for path in PAGES}
NOT_VERBS = {"VERB", "FILE", "CODE", "roslaunch"}
"""Words after `kbot` that are placeholders, or the example of a command of another tool."""


def anchors(text: str) -> set[str]:
    """The anchors that GitHub gives the headings of a page."""
    without_code = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    headings = re.findall(r"^#+ (.*)$", without_code, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_between_files_lead_somewhere(path: Path) -> None:
    """As GitHub shows them, without the site."""
    without_code = re.sub(r"^```.*?^```|`[^`\n]*`", "", TEXTS[path], flags=re.DOTALL | re.MULTILINE)
    for link in re.findall(r"\]\(([^)\s]+)\)", without_code):
        if "://" not in link:
            name, _, anchor = link.partition("#")
            target = (path.parent / name).resolve() if name else path
            assert target.exists(), link
            if anchor:
                assert anchor in anchors(target.read_text("utf-8")), link


def shell_commands(text: str) -> Iterator[list[str]]:
    """The words of each `kbot …` in blocks and spans of code, without comments."""
    code = [block for language in ("sh", "console", "bat", "") for block in blocks(text, language)]
    for line in [*"\n".join(code).splitlines(), *re.findall(r"`([^`\n]+)`", text)]:
        found = re.match(r"(?:\$ )?kbot (.*)", line.strip())
        if found:
            yield re.split(r"\s+#|\s[|;&>]", found[1])[0].split()


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_verbs_and_options_in_the_pages_exist(path: Path) -> None:
    for words in shell_commands(TEXTS[path]):
        command: click.Command = group
        context = click.Context(group)
        rest = list(words)
        while isinstance(command, click.Group) and rest and not rest[0].startswith(("-", "…")):
            name = rest.pop(0)
            if name in NOT_VERBS:
                break
            found = command.get_command(context, name)
            assert found is not None, " ".join(words)
            command = found
        known = {flag for option in command.params for flag in option.opts + option.secondary_opts}
        used = {word.partition("=")[0] for word in rest if re.match(r"--[a-z]", word)}
        assert isinstance(command, click.Group) or used <= known | {"--help"}, " ".join(words)


@pytest.mark.parametrize(
    "page",
    [
        "reference/python.md",
        "reference/sweep.md",
        "explanation/clock.md",
        "explanation/cylinder-on-a-plane.md",
        "how-to/add-your-own.md",
        "how-to/use-nav2.md",
    ],
)
def test_the_examples_in_python_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The examples of a page run one after the other, as in one program. A node needs a running KBot."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in programs(TEXTS[DOCS / page]):
        if "kbot.Node(" not in block:
            exec(block, names)


def test_the_page_of_topics_lists_those_of_a_running_kbot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    words = [sys.executable, "-m", "kbot", "sim", "kbot", "lidar:=true", "--no-browser", "--port", "0"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=dict(os.environ)) as running:
        assert running.stdout is not None
        try:
            assert "is at" in running.stdout.readline()
            assert run(["topic", "list", "-v"]) == 0
        finally:
            running.kill()
    published, subscribed = capsys.readouterr().out.split("Subscribed topics:")
    parts = sections("reference/topics.md")
    for heading, printed in (("Published", published), ("Subscribed", subscribed)):
        real = {
            topic: kind.replace("/msg/", "/") for topic, kind in re.findall(r"\* (\S+) \[(\S+)\]", printed)
        }
        rows = [row.split("|") for row in parts[heading].splitlines() if row.startswith("| `")]
        listed = {topic: row[2].strip() for row in rows for topic in re.findall(r"`(\S+)`", row[1])}
        assert listed.keys() == real.keys()
        for topic, kinds in listed.items():
            assert real[topic].rpartition("/")[2] in re.split(r"[/, ]+", kinds)
