"""Display earlier times of a run to pages that look back, while others display the present."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Generator, Sequence
from dataclasses import replace

from kbot.text import KbotError
from kbot.workbench.protocol import Notice, State, Timeline, Trail
from kbot.workbench.protocol.codec import encode
from kbot.workbench.serving.hub import Client, Hub
from kbot.workbench.session.session import Session
from kbot.workbench.timeline.driven_paths import DrivenPaths
from kbot.workbench.timeline.history import Frame, History
from kbot.workbench.timeline.saved import Saved, SavedStates
from kbot.workbench.timeline.series import SCENE, STATE, TOPIC, Field, Making, series_of_history

SAME_SECONDS = 0.005
"""Two times that are closer than this are reported as the same."""
ROUNDED = 1e-4
"""Seconds by which rounding may make a page's time earlier than the real one."""
SPACING = 0.03
"""Least distance of two points of the robot's path, as a share of its radius."""


class Past:
    """Keeps the messages of a simulation, and sends them again to pages that look back."""

    def __init__(self, session: Session, hub: Hub) -> None:
        self._session, self._hub = session, hub
        self._history = History()
        self._saved = SavedStates()
        self._paths = DrivenPaths()
        self._revision = 0
        self._scene: str = ""
        self._sent_at = 0.0
        """The time on the timeline of the state that was sent last."""
        if session.mode == "sim":
            session.along = self._history.pass_to
            session.topics.ended = lambda topic: self._history.end_of(TOPIC + topic)

    def send_state(self, state: State) -> None:
        """Send the state to pages that display the present, and keep it."""
        state = replace(state, previous_at=self._sent_at)
        self._sent_at = state.at
        text = encode(state)
        if self._session.mode == "sim":
            if self._revision != state.revision:
                self._revision, self._scene = state.revision, encode(self._session.scene)
                self._history.add(SCENE, self._scene)
            self._history.add(STATE, text)
            self._saved.keep(state.at, state.time, self._session.run, self._session.save)
            self._follow(state)
        self._hub.publish(state, text)

    def _follow(self, state: State) -> None:
        scene = self._session.scene
        if not scene.links:
            return  # there is no robot yet
        root = 7 * next(number for number, link in enumerate(scene.links) if link.name == scene.root)
        x, y = state.poses[root : root + 2]
        self._paths.add(state.resets, state.at, x, y, scene.radius * SPACING, state.jumps)
        self._paths.forget(self._history.start)

    def send_topic(self, topic: str, frame: Frame, pages: frozenset[int]) -> None:
        """Do the same for a message of a topic."""
        if self._session.mode == "sim":
            self._history.add_some(TOPIC + topic, frame)
        self._hub.send_topic(topic, frame, pages)

    def seek(self, client: Client, at: float) -> None:
        """Display the time `at` in a page, or the nearest that is kept."""
        if client.displayed_time is None:
            client.scene = self._scene
        client.displayed_time = at = min(max(at, self._history.start), self._history.end)
        keys = [TOPIC + topic for topic in self._session.topics.subscribed_by(client.number)]
        found = self._history.at(at + ROUNDED, (SCENE, STATE, *keys))
        client.silent = tuple(key.removeprefix(TOPIC) for key in keys if key not in found)
        self.send_timeline(client)
        scene = found.pop(SCENE, client.scene)
        if scene != client.scene:
            client.scene = scene
            client.put_frame(SCENE, scene)
        for key, frame in found.items():
            client.put_frame(key, frame)

    def series(self, fields: Sequence[Field], start: float, end: float) -> Making:
        """Return values from `start` to `end` on the timeline."""
        making = self._session.series(fields, start, end)
        return making if making is not None else series_of_history(self._history, fields, start, end)

    def trail(self, resets: float, after: float) -> Generator[None, None, Trail]:
        """Yield until the path is complete, and return its part after a time.

        It is the path since `resets`, or that of the whole recording.
        """
        if self._session.recorded_path is not None:
            points = yield from self._session.recorded_path(self._session.scene.radius * SPACING)
        else:
            points = self._paths.of(round(resets))
        points = points[bisect_right(points, after, key=lambda point: point.at) :]
        at, x, y, is_jump = zip(*points, strict=True) if points else ((), (), (), ())
        jumps = tuple(number for number, jump in enumerate(is_jump) if jump)
        return Trail(round(resets), after, at, x, y, jumps)

    def resume(self, client: Client) -> None:
        """Continue the simulation from the time that a page displays.

        Raises:
            KbotError: the page displays the present, or no state was saved near that time.
        """
        at = client.displayed_time
        if at is None:
            raise KbotError("go back in time first. The simulation continues from the displayed time")
        saved = self._saved.nearest(at, self._session.run)
        self._history.set_clock()
        self._paths.continue_from(saved.at)
        self._session.resume(saved.state)
        self._hub.publish(Notice(self._resume_notice(at, saved)))
        self.go_live(client)

    def _resume_notice(self, at: float, saved: Saved) -> str:
        text = f"The simulation continues from {saved.time:.2f} s"
        if abs(saved.at - at) >= SAME_SECONDS:
            time = saved.time + at - saved.at
            text += f", the saved state nearest to {time:.2f} s"
        if self._session.recording.view() is not None:
            text += ". The recording contains both runs, and plays back the later one"
        return f"{text}."

    def go_live(self, client: Client) -> None:
        """Display the present in a page."""
        if client.displayed_time is None:
            return
        client.displayed_time, client.requested_time, client.silent = None, None, ()
        self.send_timeline(client)
        if client.scene != self._scene:
            client.put(self._session.scene)
        client.put(replace(self._session.state(), previous_at=self._sent_at))
        for topic in self._session.topics.subscribed_by(client.number):
            frame = self._session.topics.newest(topic)
            if frame is not None:
                client.put_topic(topic, frame)

    def send_timeline(self, client: Client, again: bool = False) -> None:
        """Send the timeline to a page if it has changed, or always with `again`."""
        timeline = replace(self._session.timeline() or self._of_history(client), asked=client.requested_time)
        if again or timeline != client.timeline:
            client.put_timeline(timeline)

    def _of_history(self, client: Client) -> Timeline:
        start, end = round(self._history.start, 3), round(self._history.end, 3)
        is_live = client.displayed_time is None
        at = end if client.displayed_time is None else round(client.displayed_time, 3)
        session = self._session
        return Timeline(
            start,
            end,
            at,
            is_live,
            played=False,
            loop=False,
            paused=session.paused,
            speed=session.speed,
            silent=client.silent,
            recording=session.recording.view(),
        )
