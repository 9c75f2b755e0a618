"""The event handlers of ROS 2 launch files, with the names of `launch.event_handlers`."""

from __future__ import annotations

from kbot.ros.launch.ros2.actions import Action, Value


class EventHandler:
    """Runs actions when the `event` happens to another action."""

    event = "exit"

    def __init__(self, *, target_action: object = None, **more: Value) -> None:
        reaction = next((more[key] for key in ("on_exit", "on_start") if more.get(key) is not None), ())
        self.target = target_action
        self.actions = list(reaction) if isinstance(reaction, list | tuple) else [reaction]


class OnProcessExit(EventHandler):
    pass


class OnProcessStart(EventHandler):
    event = "start"


class OnShutdown(EventHandler):
    def __init__(self, **more: Value) -> None:
        super().__init__()


OnProcessIO = OnExecutionComplete = OnShutdown


class RegisterEventHandler(Action):
    def __init__(self, event_handler: EventHandler, **more: Value) -> None:
        super().__init__(**more)
        self.handler = event_handler
