"""The documentation site: it builds without a warning, and every link, anchor and picture in it exists."""

import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag

import pytest

import kbot.learn
from kbot.cli.main import VERBS
from kbot.world import BUILDERS

from .pages import DOCS


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the site, which `docs/build.py` builds as `make docs` does."""
    folder = tmp_path_factory.mktemp("site")
    ran = subprocess.run(
        [sys.executable, str(DOCS / "build.py"), str(folder)], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    return folder


class Page(HTMLParser):
    """The links and pictures of a page, and its anchors."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.anchors = {""}
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.links |= {value for name in ("href", "src") if (value := values.get(name))}
        self.anchors |= {value for name in ("id", "name") if (value := values.get(name))}


def test_every_link_in_the_site_leads_somewhere(site: Path) -> None:
    pages = {path: Page(path) for path in site.rglob("*.html")}
    broken = []
    for path, page in pages.items():
        for link in page.links:
            address, anchor = urldefrag(link)
            if ":" in address:  # another site, or an e-mail address
                continue
            target = (path.parent / unquote(address.partition("?")[0])).resolve() if address else path
            if not target.exists() or (target in pages and unquote(anchor) not in pages[target].anchors):
                broken.append(f"{path.relative_to(site)}: {link}")
    assert len(pages) > 30
    assert not broken


def test_the_generated_pages_are_complete(site: Path) -> None:
    reference = site / "docs" / "reference"
    verbs, worlds = Page(reference / "verbs.html").anchors, Page(reference / "worlds.html").anchors
    assert {f"kbot-{verb}" for verb in VERBS} <= verbs
    assert {world.replace("_", "-") for world in BUILDERS} <= worlds
    assert {"lidar", "imu", "camera"} <= Page(reference / "sensors.html").anchors
    api = Page(reference / "api.html").anchors
    assert {"kbot.Simulation", "kbot.Simulation.cmd_vel", "kbot.load"} <= api
    assert {f"kbot.learn.{name}" for name in kbot.learn.__all__} <= api


def test_the_first_page_leads_to_every_page(site: Path) -> None:
    index = site / "docs" / "index.html"
    linked = {(index.parent / urldefrag(link)[0]).resolve() for link in Page(index).links}
    parts = ("tutorial", "how-to", "reference", "explanation")
    assert {path for part in parts for path in (site / "docs" / part).glob("*.html")} <= linked
