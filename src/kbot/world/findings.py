"""What there is to say about a world, or a robot on its way into the simulation.

Codes: W101 a body that weighs nothing, W102 bad mass, W103 bad inertia, W104 inertia that no body has, W105
a joint without an axis, W106 a shape that cannot touch, W107 a robot that touches nothing, W108 a mimic
that follows nothing, W109 bad limits, W110 what the engine refuses or warns of, W111 a start inside
something, W112 too long a chain of joints, W113 an absurd size or mass, W114 a moving link that weighs
nothing, W120 a run that diverged; W130 a number that is none, W131 a size that the drive has wrong, W132 a
file of parameters that cannot be used, W133 a link that is not there, W134 a joint that is not there or is
not a driving wheel's, W135 a controller that is not run, W136 friction that differs by direction, W137 a
controller that is not loaded, W138 one whose joint lacks the interface; W140 a setting of a sensor that is
left out, W141 a sensor that cannot be used, W145 a joint that a drive names twice, W146 a drive that moves
the robot against its commands.

Of worlds: W201 no SDF, W202 a model that is not found, W203 a ring of includes, W204 bad number,
W205 something missing, W206 a shape that cannot be built, W207 an unknown frame, W208 a name that
comes twice, W210 what is not simulated.
"""

from __future__ import annotations

from kbot.text import DescriptionError, Diagnostic, Origin, Severity


class Findings:
    """Collects diagnostics, so that one run reports them all."""

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []

    def error(self, code: str, message: str, origin: Origin | None, hint: str = "") -> None:
        self.diagnostics.append(Diagnostic(code, Severity.ERROR, message, origin, hint))

    def warning(self, code: str, message: str, origin: Origin | None, hint: str = "") -> None:
        self.diagnostics.append(Diagnostic(code, Severity.WARNING, message, origin, hint))

    def info(self, code: str, message: str, origin: Origin | None, hint: str = "") -> None:
        self.diagnostics.append(Diagnostic(code, Severity.INFO, message, origin, hint))

    def require(self) -> None:
        """Raises DescriptionError with all diagnostics when one of them is an error."""
        if any(d.is_error for d in self.diagnostics):
            raise DescriptionError(self.diagnostics)
