"""Shows earlier times of a run to pages that look back, while others see the present."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace

from kbot.text import KbotError
from kbot.workbench.protocol import Notice, State, Timeline, Trail
from kbot.workbench.protocol.codec import encode
from kbot.workbench.serving.hub import Client, Hub
from kbot.workbench.session.session import Session
from kbot.workbench.timeline.history import Frame, History
from kbot.workbench.timeline.saved import Saved, SavedStates
from kbot.workbench.timeline.series import SCENE, STATE, TOPIC, Field, Making, series_of_history
from kbot.workbench.timeline.ways import Ways

SAME_SECONDS = 0.005
"""Between two moments that are told as one."""
ROUNDED = 1e-4
"""Seconds by which a page may know a moment to be earlier than it was."""
SPACING = 0.03
"""Between two places of the robot's way, by its own radius."""


class Past:
    """Keeps what pages are told of a simulation, and shows it again to those who ask."""

    def __init__(self, session: Session, hub: Hub) -> None:
        self._session, self._hub = session, hub
        self._history = History()
        self._saved = SavedStates()
        self._ways = Ways()
        self._revision = 0
        self._scene: str = ""
        if session.mode == "sim":
            session.along = self._history.pass_to
            session.topics.ended = lambda topic: self._history.end_of(TOPIC + topic)

    def tell_state(self, state: State) -> None:
        """Tell those who look at what is, and keep it for later."""
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
        root = 7 * next(number for number, link in enumerate(scene.links) if link.name == scene.root)
        x, y = state.poses[root : root + 2]
        self._ways.add(state.resets, state.at, x, y, scene.radius * SPACING, state.jumps)
        self._ways.forget(self._history.start)

    def tell_topic(self, topic: str, frame: Frame, pages: frozenset[int]) -> None:
        """As `tell_state`, for one message of a topic."""
        if self._session.mode == "sim":
            self._history.add_some(TOPIC + topic, frame)
        self._hub.hand_out(topic, frame, pages)

    def seek(self, client: Client, at: float) -> None:
        """Show a page the moment `at`, or the nearest that is kept."""
        if client.looks_at is None:
            client.scene = self._scene
        client.looks_at = at = min(max(at, self._history.start), self._history.end)
        heard = [TOPIC + topic for topic in self._session.topics.heard_by(client.number)]
        found = self._history.at(at + ROUNDED, (SCENE, STATE, *heard))
        client.silent = tuple(key.removeprefix(TOPIC) for key in heard if key not in found)
        self.tell_time(client)
        scene = found.pop(SCENE, client.scene)
        if scene != client.scene:
            client.scene = scene
            client.put_frame(SCENE, scene)
        for key, frame in found.items():
            client.put_frame(key, frame)

    def series(self, fields: Sequence[Field], start: float, end: float) -> Making:
        """How numbers went from `start` to `end` seconds along the timeline."""
        making = self._session.series(fields, start, end)
        return making if making is not None else series_of_history(self._history, fields, start, end)

    def trail(self, resets: float) -> Generator[None, None, Trail]:
        """The way since so many resets, or of the whole recording that is played, made a little at a time."""
        if self._session.way is not None:
            points = yield from self._session.way(self._session.scene.radius * SPACING)
        else:
            points = self._ways.of(round(resets))
        at, x, y, is_jump = zip(*points, strict=True) if points else ((), (), (), ())
        return Trail(round(resets), at, x, y, tuple(number for number, jump in enumerate(is_jump) if jump))

    def resume(self, client: Client) -> None:
        """Let the simulation go on from the moment that a page is shown.

        Raises:
            KbotError: the page is shown what is, or nothing was saved near that moment.
        """
        at = client.looks_at
        if at is None:
            raise KbotError("go back to a moment first: the simulation goes on from the one on show")
        saved = self._saved.nearest(at, self._session.run)
        self._history.set_clock()
        self._ways.go_on_from(saved.at)
        self._session.resume(saved.state)
        self._hub.publish(Notice(self._way_on(at, saved)))
        self.go_live(client)

    def _way_on(self, at: float, saved: Saved) -> str:
        told = f"The simulation goes on from {saved.time:.2f} s"
        if abs(saved.at - at) >= SAME_SECONDS:
            time = saved.time + at - saved.at
            told += f", the saved state that is nearest to {time:.2f} s"
        if self._session.recording.view() is not None:
            told += "; the recording holds both ways, and plays the later one"
        return f"{told}."

    def go_live(self, client: Client) -> None:
        """Show a page what is."""
        if client.looks_at is None:
            return
        client.looks_at, client.asked, client.silent = None, None, ()
        self.tell_time(client)
        if client.scene != self._scene:
            client.put(self._session.scene)
        client.put(self._session.state())
        for topic in self._session.topics.heard_by(client.number):
            frame = self._session.topics.newest(topic)
            if frame is not None:
                client.put_topic(topic, frame)

    def tell_time(self, client: Client, again: bool = False) -> None:
        """Tell a page what there is to go back to, where that is news or it is to be told `again`."""
        timeline = replace(self._session.timeline() or self._of_history(client), asked=client.asked)
        if again or timeline != client.timeline:
            client.put_time(timeline)

    def _of_history(self, client: Client) -> Timeline:
        start, end = round(self._history.start, 3), round(self._history.end, 3)
        is_live = client.looks_at is None
        at = end if client.looks_at is None else round(client.looks_at, 3)
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
