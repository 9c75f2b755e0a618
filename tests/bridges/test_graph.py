"""How `kbot topic` and the other verbs find a running KBot, and which clients KBot accepts."""

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

from .conftest import Capture, Running, run_verb


def test_error_when_no_kbot_is_running(graph_folder: Path, capsys: Capture) -> None:
    assert "no KBot is running. Start one" in run_verb(capsys, "topic", "list", status=2)


def test_files_of_dead_processes_are_deleted(graph: GraphServer, graph_folder: Path, capsys: Capture) -> None:
    dead = 1 << 30  # above the largest process ID of Linux, 2^22
    stale = graph_folder / f"{dead}.json"
    stale.write_text(json.dumps({"pid": dead, "address": "ws://127.0.0.1:1", "robot": "r", "world": "w"}))
    (graph_folder / "half.json").write_text('{"pid"')
    assert "/odom" in run_verb(capsys, "topic", "list").splitlines()
    assert not stale.exists()


def test_answers_reports_whether_a_server_accepts_connections(graph: GraphServer) -> None:
    """Windows needs this: there, a signal cannot show whether a process is alive."""
    (known,) = presence.running()
    assert presence.answers(known.address)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    assert not presence.answers(f"ws://127.0.0.1:{port}/?token=a")
    assert not presence.answers("nothing")


def test_at_selects_one_of_several_running_kbots(graph: GraphServer, capsys: Capture) -> None:
    since = time.mktime((2026, 11, 21, 9, 30, 5, 0, 0, -1))
    other = presence.Presence(
        os.getppid(), "ws://127.0.0.1:1", "other", "/a/boxes", f"kbot sim a.xacro {'b' * 300}", since
    )
    presence.announce(other)
    error = run_verb(capsys, "topic", "list", status=2)
    assert f"\n  --at {os.getppid()}   other in 'boxes' since 09:30:05: kbot sim a.xacro …\n" in f"{error}\n"
    assert f"\n  --at {os.getpid()}   " in error
    assert max(map(len, error.splitlines())) < 110
    assert "/odom" in run_verb(capsys, "topic", "list", "--at", str(os.getpid()))
    assert "no KBot with process ID 5 is running" in run_verb(capsys, "topic", "list", "--at", "5", status=2)
    assert "no KBot answers" in run_verb(capsys, "topic", "list", "--at", str(os.getppid()), status=2)


def test_presence_file_is_private_and_deleted_at_close(running: Running, graph_folder: Path) -> None:
    server = GraphServer(running.link)
    server.announce("kbot", "empty")
    (file,) = graph_folder.iterdir()
    assert file.stat().st_mode & 0o077 == 0
    server.close()
    assert not list(graph_folder.iterdir())


def test_a_client_without_the_token_is_refused(graph: GraphServer) -> None:
    with pytest.raises(InvalidStatus, match="403"):
        connect(graph.address.rpartition("/")[0] + "/")


def test_close_does_not_wait_for_an_idle_connection(running: Running) -> None:
    """Browsers open connections in advance, without a request."""
    server = GraphServer(running.link)
    with socket.create_connection(("127.0.0.1", urlsplit(server.address).port or 0)) as idle:
        with connect(server.address):
            pass  # connections are accepted in order: now the idle one is accepted too
        server.close()
        idle.setblocking(False)
        with pytest.raises(BlockingIOError):
            idle.recv(1)


def test_error_when_a_message_is_too_large(running: Running, graph: GraphServer, capsys: Capture) -> None:
    with GraphClient(graph.address) as client, pytest.raises(KbotError, match="larger than KBot accepts"):
        client.publish_and_wait("/cmd_vel", {"frame": "a" * (5 << 20)}, "geometry_msgs/msg/Twist")
    assert running.is_stepping()
    assert run_verb(capsys, "topic", "type", "/odom") == "nav_msgs/msg/Odometry\n"
