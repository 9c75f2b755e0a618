"""What pages may read and change: the description's own files, and no others."""

import http.client
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from websockets.sync.client import ClientConnection, connect

from kbot.workbench.serve import open_session, serving

HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
ROBOT = f'{HEAD}<link name="base"/></robot>'
Ask = Callable[..., Any]


class Workspace:
    """A package, a file beside the package, and a page of it."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.package = folder, folder / "robot"
        self.package.mkdir()
        (self.package / "package.xml").write_text("<package><name>robot</name></package>")
        self.robot = self.package / "robot.xacro"
        self.robot.write_text(ROBOT)
        self.secret = folder / "secret.xacro"
        self.secret.write_text("export TOKEN=1.0")

    def text(self, *elements: str) -> str:
        return f"{HEAD}<link name='base'/>{''.join(elements)}</robot>"


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    return Workspace(tmp_path)


@pytest.fixture
def url(workspace: Workspace) -> Iterator[str]:
    with serving(open_session(str(workspace.robot), simulate=False)) as url:
        yield url


@pytest.fixture
def page(url: str) -> Iterator[ClientConnection]:
    with connect(url.replace("http:", "ws:") + "ws", max_size=None) as page:
        answer(page, "findings")
        yield page


def answer(page: ClientConnection, *kinds: str) -> Any:
    """Return the next message of one of these types."""
    end = time.monotonic() + 60
    while time.monotonic() < end:
        data = page.recv(60)
        if isinstance(data, str) and (message := json.loads(data))["type"] in kinds:
            return message
    raise AssertionError(f"the server sends other messages, but none of {kinds}")


def ask(page: ClientConnection, kind: str, *kinds: str, **fields: object) -> Any:
    page.send(json.dumps({"type": kind, **fields}))
    return answer(page, "refused", *kinds)


def save(page: ClientConnection, workspace: Workspace, text: str) -> Any:
    """Save the robot, and return the findings of the saved version."""
    was = workspace.robot.read_text()
    ask(page, "save_source", "source_saved", file=str(workspace.robot), was=was, text=text)
    return answer(page, "findings")


INCLUDES = [
    '<xacro:include filename="{}"/>',
    '<xacro:include filename="{}" optional="true"/>',
    '<xacro:property name="p" value="${{xacro.load_yaml(\'{}\')}}"/><link name="l${{p}}"/>',
]


@pytest.mark.parametrize("include", INCLUDES)
def test_a_page_cannot_change_a_file_that_it_names(
    workspace: Workspace, page: ClientConnection, include: str
) -> None:
    save(page, workspace, workspace.text(include.format(workspace.secret)))
    save(page, workspace, workspace.text(include.format(workspace.secret), "<link name='other'/>"))
    before = workspace.secret.read_text()
    where = {"file": str(workspace.secret), "line": 1, "column": 14}
    refused = ask(page, "edit_source", **where, was="1.0", text="2.0")
    assert "is not part of this description" in refused["reason"]
    refused = ask(page, "open_source", "source", file=str(workspace.secret))
    assert "is not part of this description" in refused["reason"]
    assert workspace.secret.read_text() == before


def test_a_file_outside_that_the_user_includes_is_shown_but_not_changed(workspace: Workspace) -> None:
    workspace.secret.write_text(f'{HEAD}<xacro:property name="width" value="0.1"/></robot>')
    workspace.robot.write_text(workspace.text(f'<xacro:include filename="{workspace.secret}"/>'))
    with (
        serving(open_session(str(workspace.robot), simulate=False)) as url,
        connect(url.replace("http:", "ws:") + "ws", max_size=None) as page,
    ):
        page.send(json.dumps({"type": "set_parameter", "kind": "property", "name": "width", "value": 0.2}))
        refused = ask(page, "keep_parameters")
    assert "so the page does not open it" in refused["reason"]
    assert 'value="0.1"' in workspace.secret.read_text()


@pytest.mark.parametrize("name", ["drive.py", "id_rsa", ".hidden.yaml", "new.sh"])
def test_only_descriptions_and_yaml_are_opened(
    workspace: Workspace, page: ClientConnection, name: str
) -> None:
    file = workspace.package / name
    if name != "new.sh":
        file.write_text("print(1)")
    save(page, workspace, workspace.text(f'<xacro:include filename="{file}"/>'))
    was = file.read_text() if file.exists() else None
    refused = ask(page, "save_source", "source_saved", file=str(file), was=was, text="print(2)")
    assert refused["type"] == "refused"
    assert not file.exists() or file.read_text() == "print(1)"


def test_a_page_does_not_learn_the_names_of_other_files(
    workspace: Workspace, page: ClientConnection, url: str
) -> None:
    found = save(page, workspace, workspace.text(f'<xacro:include filename="{workspace.folder}/*.xacro"/>'))
    assert "secret" not in json.dumps(found)
    with connect(url.replace("http:", "ws:") + "ws", max_size=None) as other:
        assert answer(other, "about")["files"] == [str(workspace.robot)]


def test_packages_beside_the_own_one_are_read(workspace: Workspace, page: ClientConnection) -> None:
    other = workspace.folder / "parts"
    other.mkdir()
    (other / "package.xml").write_text("<package><name>parts</name></package>")
    (other / "wheel.xacro").write_text("<robot><link name='wheel'/></robot>")
    text = workspace.text('<xacro:include filename="$(find parts)/wheel.xacro"/>')
    found = ask(page, "check_texts", "texts_checked", number=1, files=[str(workspace.robot)], texts=[text])
    assert found["type"] == "texts_checked"
    assert [f for f in found["findings"] if f["code"].startswith(("F", "X"))] == []
    included = workspace.text(f'<xacro:include filename="{other}/wheel.xacro"/>')
    codes = [found["code"] for found in save(page, workspace, included)["findings"]]
    assert [code for code in codes if code.startswith(("F", "X"))] == []


def test_the_configuration_above_the_package_is_used(workspace: Workspace, page: ClientConnection) -> None:
    (workspace.folder / "pyproject.toml").write_text('[tool.kbot]\nignore = ["S103"]\n')
    found = ask(page, "check_texts", "texts_checked", number=1, files=[str(workspace.robot)], texts=[ROBOT])
    assert found["type"] == "texts_checked"
    assert "stale" in save(page, workspace, workspace.text("<link name='other'/>"))


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "image"}, 403),
        ({"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "iframe"}, 403),
        ({"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}, 200),
        ({"Sec-Fetch-Site": "same-origin", "Sec-Fetch-Mode": "cors", "Sec-Fetch-Dest": "empty"}, 200),
        ({"Sec-Fetch-Site": "none", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}, 200),
        ({}, 200),
    ],
)
def test_pages_of_other_sites_load_nothing(url: str, headers: dict[str, str], status: int) -> None:
    connection = http.client.HTTPConnection(urlsplit(url).netloc, timeout=60)
    connection.request("GET", "/export/robot.glb" if headers else "/", headers=headers)
    assert connection.getresponse().status == status
    connection.close()
