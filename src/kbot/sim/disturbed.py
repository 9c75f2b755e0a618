"""A running world that is disturbed: pushes, kicks, and faults at their times."""

from __future__ import annotations

from kbot.sim.disturbances import FOREVER, Placed, Push
from kbot.sim.engine.welds import STANDING
from kbot.sim.faults import FAULTS, Fault, Kick, to_journal
from kbot.sim.numbers import FASTEST, LONGEST, STRONGEST, Vector, is_within, positive, shortened, vector
from kbot.sim.population import Population
from kbot.text import KbotError


class Disturbed(Population):
    """A running world with what acts on robots from outside, and until when."""

    def set_twist(self, linear: Vector, angular: Vector = (0.0, 0.0, 0.0), robot: str | None = None) -> None:
        """Give the robot's body a speed at once, as a kick does: m/s and rad/s along the world's axes.

        Raises:
            KbotError: a number is not finite, no such robot, it is fixed to the world, or the run has
                diverged.
        """
        self.require_sound()
        linear = vector("a speed in m/s", linear, FASTEST)
        angular = vector("a turning speed in rad/s", angular, FASTEST)
        moved = self.named(robot)
        moved._set_twist(linear, angular)
        self.frames_are_old()
        self._note("set_twist", robot=moved.name, linear=linear, angular=angular)

    def apply_body_wrench(
        self,
        link: str,
        force: Vector,
        duration: float,
        torque: Vector = (0.0, 0.0, 0.0),
        robot: str | None = None,
    ) -> None:
        """Push a link, or a body of the world where none is called so, with a force (N) and a torque (N m)
        along the world's axes, at its centre of mass, for `duration` seconds.

        Raises:
            KbotError: a number is not finite, no such robot, link or body, or a duration that is none.
        """
        force, torque = vector("a force in N", force, STRONGEST), vector("a torque in N m", torque, STRONGEST)
        duration = positive("the time of a push in seconds", duration, LONGEST)
        body = self._body_called(link, robot)
        if body == STANDING:
            raise KbotError(f"'{link}' stands still for good: nothing pushes it")
        until = self._steps + max(1, round(duration / self.timestep))
        self._disturbances.push(Push(body, force, torque, until))
        self._plan_stop()
        self._note("apply_body_wrench", link=link, robot=robot, force=force, torque=torque, until=until)

    def clear_body_wrenches(self, link: str, robot: str | None = None) -> None:
        """Push a link or body no longer.

        Raises:
            KbotError: no such robot, link or body.
        """
        self._disturbances.push_no_longer(self._body_called(link, robot))
        self._plan_stop()
        self._note("clear_body_wrenches", link=link, robot=robot)

    def schedule(self, fault: Fault, at: float, duration: float | None = None) -> int:
        """Let something go wrong `at` seconds of simulated time, for `duration` seconds (None is for good).
        It stays in the schedule over a reset, and comes again, until `end_fault` takes it out by the number
        that is returned, or the robot goes that it speaks of.

        Raises:
            KbotError: a time that is none or is past, a fault of something that is not there, or a kick in a
                run that has diverged.
        """
        if not isinstance(fault, Fault):
            known = ", ".join(FAULTS)
            raise KbotError(f"a fault is one of kbot.sim.faults ({known}), not {shortened(fault)}")
        start = round(at / self.timestep) if is_within(at, LONGEST) else -1
        if start < self._steps:
            told = f"from now ({self.time:g} s) to {LONGEST:g} s, not at {shortened(at)} s"
            raise KbotError(f"a fault is placed at a time {told}")
        if duration is not None:
            duration = positive("the time of a fault in seconds", duration, LONGEST)
        stop = FOREVER if duration is None else start + max(1, round(duration / self.timestep))
        if isinstance(fault, Kick):
            self.named(fault.robot).require_free()
            self.require_sound()
            stop = start + 1
        elif (end := fault.begin(self)) is not None:
            end()  # begun on trial: what it speaks of is there
        number = self._disturbances.place(fault, start, stop)
        self._plan_stop()
        if self.journal is not None:
            self._note("schedule", **to_journal(fault), at=float(at), duration=duration)
        return number

    def end_fault(self, number: int) -> None:
        """Let a fault be over, and not come again.

        Raises:
            KbotError: there is none of that number.
        """
        if not self._disturbances.take_out(number):
            known = ", ".join(str(one) for one in self._disturbances.numbers) or "none at all"
            raise KbotError(f"there is no fault {shortened(number)} (there are {known})")
        self._plan_stop()
        self._note("end_fault", number=int(number))

    @property
    def faults(self) -> tuple[Placed, ...]:
        """The faults that act now or are to come."""
        return self._disturbances.faults(self.timestep)
