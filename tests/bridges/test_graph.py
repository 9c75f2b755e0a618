"""Where a running KBot is found by `kbot topic` and its like, and whom it answers."""

import json
import os
import socket
import time
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from kbot.ros.graph import presence
from kbot.ros.graph.client import GraphClient
from kbot.ros.graph.server import GraphServer
from kbot.text import KbotError

from .conftest import Running, Said, told


def test_none_runs(graph_folder: Path, capsys: Said) -> None:
    assert "no KBot runs here; start one" in told(capsys, "topic", "list", status=2)


def test_files_of_dead_ones_are_taken_away(graph: GraphServer, graph_folder: Path, capsys: Said) -> None:
    """The kernel's largest process number is beyond every one that lives."""
    dead = 1 << 30
    stale = graph_folder / f"{dead}.json"
    stale.write_text(json.dumps({"pid": dead, "address": "ws://127.0.0.1:1", "robot": "r", "world": "w"}))
    (graph_folder / "half.json").write_text('{"pid"')
    assert "/odom" in told(capsys, "topic", "list").splitlines()
    assert not stale.exists()


def test_where_processes_cannot_be_asked_an_address_that_answers_tells_who_lives(graph: GraphServer) -> None:
    (known,) = presence.running()
    assert presence.answers(known.address)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    assert not presence.answers(f"ws://127.0.0.1:{port}/?token=a")
    assert not presence.answers("nothing")


def test_several_run_and_one_is_named(graph: GraphServer, capsys: Said) -> None:
    since = time.mktime((2026, 11, 21, 9, 30, 5, 0, 0, -1))
    other = presence.Presence(
        os.getppid(), "ws://127.0.0.1:1", "other", "/a/boxes", f"kbot sim a.xacro {'b' * 300}", since
    )
    presence.announce(other)
    error = told(capsys, "topic", "list", status=2)
    assert f"\n  --at {os.getppid()}   other in 'boxes' since 09:30:05: kbot sim a.xacro …\n" in f"{error}\n"
    assert f"\n  --at {os.getpid()}   " in error
    assert max(map(len, error.splitlines())) < 110
    assert "/odom" in told(capsys, "topic", "list", "--at", str(os.getpid()))
    assert "no KBot 5 runs" in told(capsys, "topic", "list", "--at", "5", status=2)
    assert "no KBot answers" in told(capsys, "topic", "list", "--at", str(os.getppid()), status=2)


def test_the_file_is_private_and_goes_with_the_one_it_speaks_of(running: Running, graph_folder: Path) -> None:
    server = GraphServer(running.link)
    server.announce("kbot", "empty")
    (file,) = graph_folder.iterdir()
    assert file.stat().st_mode & 0o077 == 0
    server.close()
    assert not list(graph_folder.iterdir())


def test_strangers_have_no_token(graph: GraphServer) -> None:
    with pytest.raises(InvalidStatus, match="403"):
        connect(graph.address.rpartition("/")[0] + "/")


def test_a_client_that_asks_for_nothing_is_not_waited_for(running: Running) -> None:
    """As a browser's, which connects before it knows what for."""
    server = GraphServer(running.link)
    with socket.create_connection(("127.0.0.1", urlsplit(server.address).port or 0)) as idle:
        with connect(server.address):
            pass  # who came first is let in as well
        server.close()
        idle.setblocking(False)
        with pytest.raises(BlockingIOError):
            idle.recv(1)


def test_what_is_too_large_for_one_message_is_said(
    running: Running, graph: GraphServer, capsys: Said
) -> None:
    with GraphClient(graph.address) as client, pytest.raises(KbotError, match="more than KBot takes in one"):
        client.say("/cmd_vel", {"frame": "a" * (5 << 20)}, "geometry_msgs/msg/Twist")
    assert running.goes_on()
    assert told(capsys, "topic", "type", "/odom") == "nav_msgs/msg/Odometry\n"
