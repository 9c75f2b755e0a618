"""What a user saves from the page."""

import io
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from kbot.workbench.session.session import Session

from .conftest import until

OpenPage = Callable[..., Any]


def saved(page: Any, label: str) -> bytes:
    with page.expect_download() as download:
        page.get_by_role("button", name=label).click()
    return Path(download.value.path()).read_bytes()


def test_a_picture_is_saved_with_and_without_its_floor(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.locator(".save-menu summary").click()
    page.get_by_label("Width in pixels").fill("640")
    page.get_by_label("Height in pixels").fill("480")
    image = np.asarray(Image.open(io.BytesIO(saved(page, "Image (PNG)"))))
    assert image.shape == (480, 640, 4)
    assert image[..., 3].min() == 255
    page.get_by_label("transparent").check()
    image = np.asarray(Image.open(io.BytesIO(saved(page, "Image (PNG)"))))
    assert image[2, 2, 3] == image[-3, -3, 3] == 0
    blue = (image[..., 2] > 90) & (image[..., 0] < 60) & (image[..., 3] == 255)
    assert 0.02 < blue.mean() < 0.5  # KBot's plate, without a background
    page.get_by_label("Width in pixels").fill("0")
    page.get_by_role("button", name="Image (PNG)").click()
    assert page.get_by_label("Width in pixels").evaluate("e => !e.validity.valid")


def test_a_page_and_a_model_are_saved(viewing: str, open_page: OpenPage) -> None:
    page = open_page(viewing)
    page.locator(".save-menu summary").click()
    assert saved(page, "Model (GLB)").startswith(b"glTF")
    html = saved(page, "Page in one file (HTML)")
    assert html.startswith(b"<!doctype html>")
    assert b'id="saved"' in html


def test_a_film_is_saved(driving: tuple[str, Session], open_page: OpenPage) -> None:
    page = open_page(driving[0])
    page.locator(".save-menu summary").click()
    page.get_by_role("button", name="Record a video").click()
    frames = page.evaluate("kbot.frames")
    page.keyboard.down("w")
    until(lambda: page.evaluate("kbot.frames") > frames + 5)
    page.keyboard.up("w")
    assert saved(page, "Stop and save the video").startswith(b"\x1aE\xdf\xa3")  # EBML, as WebM starts


def test_the_first_picture_needs_no_socket(viewing: str, browser: Any) -> None:
    page = browser.new_page()
    page.add_init_script("window.WebSocket = class { static OPEN = 1; addEventListener() {} };")
    page.goto(viewing)
    until(lambda: page.evaluate("!!window.kbot && kbot.frames > 0 && kbot.revision > 0"))
    page.close()


def test_the_page_takes_less_than_400_kilobytes_compressed(viewing: str) -> None:
    import gzip
    import re

    html = urllib.request.urlopen(viewing).read()
    names = re.findall(rb'(?:src|href)="\./(assets/[^"]+)"', html)
    assert len(names) >= 3
    sent = [html, *(urllib.request.urlopen(viewing + name.decode()).read() for name in names)]
    folder = Path(__file__).parents[2] / "src" / "kbot" / "workbench" / "page" / "assets"
    scripts = [file.read_bytes() for file in folder.iterdir() if file.suffix in (".js", ".css", ".woff2")]
    assert sum(len(gzip.compress(part)) for part in sent) < 400_000
    # the text editor is loaded when it first opens
    editor = {file.read_bytes() for file in folder.glob("editor-*.js")}
    assert editor
    assert sum(len(gzip.compress(part)) for part in (html, *scripts) if part not in editor) < 400_000
    assert sum(len(gzip.compress(part)) for part in editor) < 160_000
