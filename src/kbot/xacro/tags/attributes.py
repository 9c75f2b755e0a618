"""The attributes of xacro's own tags: those they need, those they may have."""

from __future__ import annotations

from kbot.text.suggest import did_you_mean
from kbot.xacro.faults import Fault
from kbot.xacro.location import name_span

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.text.nodes import Element
    from kbot.xacro.place import Place
    from kbot.xacro.run import Run


def check_attributes(
    run: Run, node: Element, place: Place, required: tuple[str, ...], optional: tuple[str, ...] = ()
) -> None:
    """Warn of attributes that a tag does not have.

    Raises:
        Fault: one that it needs is missing.
    """
    attributes = node.attributes
    if tuple(attributes) == required:
        return
    known = (*required, *optional)
    unknown = [name for name in attributes if name not in known and not name.startswith("xmlns:")]
    for name in required:
        if name not in attributes:
            hint = f"'{unknown[0]}' was given" if did_you_mean(name, unknown) or len(unknown) == 1 else ""
            raise Fault("X120", f"<{node.tag}> has no attribute '{name}'", hint)
    for name in unknown:
        hint = did_you_mean(name, [n for n in known if n not in attributes])
        run.warn_at(
            "X203",
            f"<{node.tag}> has no use for the attribute '{name}'",
            name_span(node, name, place.call),
            hint or f"it takes {', '.join(known)}",
        )
