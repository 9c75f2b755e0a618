"""A simulation with a link, which the bridges under test share."""

import kbot
from kbot.record.feed import Feed
from kbot.ros.bridges.link import PeerLink
from kbot.ros.gazebo.gazebo_services import gazebo_services

SIMULATION = kbot.Simulation(kbot.load("kbot"))
LINK = PeerLink(lambda text: None)
LINK.services = gazebo_services()
LINK.attach(SIMULATION, Feed(SIMULATION.bus, lambda: SIMULATION.clock.nanoseconds))
