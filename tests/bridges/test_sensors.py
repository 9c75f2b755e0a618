"""Scans of a lidar in recordings and at bridges."""

import json
from pathlib import Path

import numpy as np
from websockets.sync.client import connect

import kbot
from kbot.messages.sensing import LaserScan
from kbot.record import Recorder, Recording
from kbot.record.encodings.serialization import decode_cdr, decode_ros1
from kbot.record.feed import Feed
from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.rosbridge.bridge import RosbridgeBridge
from kbot.sensors import Lidar
from kbot.sim import Simulation


def test_recorded_scans_equal_the_published_ones(tmp_path: Path) -> None:
    sim = Simulation(kbot.load("kbot"), "boxes")
    sim.add_sensor(Lidar(link="base_link", name="scan", samples=90))
    published: list[LaserScan] = []
    sim.bus.subscribe("/scan", LaserScan, published.append)
    for name in ("run.mcap", "run.bag"):
        with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(tmp_path / name)):
            published.clear()
            sim.run(1.0)
        entries = [e for e in Recording(str(tmp_path / name)).entries() if e.topic == "/scan"]
        assert len(entries) == len(published) == 10
        for entry, scan in zip(entries, published, strict=True):
            assert entry.type_name == "sensor_msgs/msg/LaserScan"
            np.testing.assert_array_equal(decode_cdr(entry.cdr, LaserScan).ranges, scan.ranges)
            np.testing.assert_array_equal(decode_ros1(entry.ros1, LaserScan).ranges, scan.ranges)
            assert entry.nanoseconds == scan.header.stamp.nanoseconds


def test_a_sensor_that_is_added_later_is_visible_to_peers() -> None:
    sim = Simulation(kbot.load("kbot"), "boxes")
    link = PeerLink(print)
    link.attach(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds))
    bridge = RosbridgeBridge(link, port=0)
    try:
        with connect(bridge.address) as client:
            sim.run(0.1)
            sim.add_sensor(Lidar(link="base_link", name="scan", samples=10))
            sim.run(0.1)
            client.send(json.dumps({"op": "subscribe", "topic": "/scan", "type": "sensor_msgs/LaserScan"}))
            for _ in range(200):
                sim.run(0.1)
                try:
                    message = json.loads(client.recv(0.05))
                except TimeoutError:
                    continue
                assert message["topic"] == "/scan"
                assert len(message["msg"]["ranges"]) == 10
                return
            raise AssertionError("no scan was received")
    finally:
        bridge.close()
