"""What `kbot.ros` adds to the core. Imports nothing heavy, because the core reads it at every start."""

from __future__ import annotations

FILE_KINDS = ("kbot.ros.checks.launches:LAUNCH_FILES",)
RULE_PAGES = ("kbot.ros.checks.pages",)
VERBS = {
    "launch": ("kbot.cli.ros.launch.command:command", "Run a ROS 1 or ROS 2 launch file without ROS."),
    "topic": (
        "kbot.cli.ros.graph.topic:command",
        "List, print, measure and publish topics of a running KBot.",
    ),
    "node": ("kbot.cli.ros.graph.node:command", "List and describe the nodes of a running KBot."),
    "service": ("kbot.cli.ros.graph.service:command", "List, describe and call services of a running KBot."),
    "param": ("kbot.cli.ros.graph.param:command", "Read and set the parameters of a running KBot."),
    "tf": ("kbot.cli.ros.graph.tf:command", "Print the coordinate frames of a running KBot."),
}
PEERS = "kbot.cli.ros.peer_flags"
PROGRAM_RUNNER = "kbot.ros.lockstep.programs"
