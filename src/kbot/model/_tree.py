"""Whether links and joints make one tree, and what keeps them from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from kbot.model._values import Values
from kbot.model.joint import Joint
from kbot.model.link import Link
from kbot.text import Origin, Related
from kbot.text.suggest import did_you_mean, nearest


def check_tree(links: Mapping[str, Link], joints: Sequence[Joint], unread: set[str], values: Values) -> bool:
    """Report what keeps `joints` from making one tree of `links`; True when nothing does.

    `unread` names links whose joint could not be read: they are not blamed for having no parent.
    """
    faults = len(values.diagnostics)
    excused = set(unread)
    whole: list[Joint] = []
    for joint in joints:
        ends = ("U006", joint.parent, joint.parent_origin), ("U007", joint.child, joint.child_origin)
        missing = [(code, link, origin) for code, link, origin in ends if link not in links]
        for code, link, origin in missing:
            excused.update(nearest(link, links), {joint.child})
            _undefined(code, joint, link, origin, links, values)
        if not missing:
            whole.append(joint)
    parents = _single_parents(whole, values)
    in_cycle = _report_cycles(parents, values)
    _report_roots(links, parents, excused | in_cycle, values)
    return len(values.diagnostics) == faults


def _undefined(
    code: str, joint: Joint, link: str, origin: Origin, links: Mapping[str, Link], values: Values
) -> None:
    end = "parent" if code == "U006" else "child"
    hint = did_you_mean(link, links)
    values.error(code, f"joint '{joint.name}' has the {end} '{link}', which is no link", origin, hint)


def _single_parents(joints: Sequence[Joint], values: Values) -> dict[str, Joint]:
    """The joint above each link; a second one is an error."""
    parents: dict[str, Joint] = {}
    for joint in joints:
        first = parents.setdefault(joint.child, joint)
        if first is not joint:
            values.error(
                "U010",
                f"link '{joint.child}' has two parents: '{first.parent}' by joint '{first.name}' "
                f"and '{joint.parent}' by joint '{joint.name}'",
                joint.child_origin,
                "a link is the child of one joint",
                (Related("the first is here", first.child_origin),),
            )
    return parents


def _report_cycles(parents: Mapping[str, Joint], values: Values) -> set[str]:
    """Report each ring of links once; returns the links in rings."""
    done: set[str] = set()
    rings: set[str] = set()
    for start in parents:
        path: list[str] = []
        link = start
        while link in parents and link not in done:
            done.add(link)
            path.append(link)
            link = parents[link].parent
        if link in path:
            ring = path[path.index(link) :]
            rings.update(ring)
            chain = " -> ".join(f"'{name}'" for name in [link, *reversed(ring)])
            related = tuple(Related(f"joint '{parents[n].name}'", parents[n].origin) for n in ring[1:])
            values.error(
                "U009", f"links hang in a ring: {chain}", parents[link].child_origin, related=related
            )
    return rings


def _report_roots(
    links: Mapping[str, Link], parents: Mapping[str, Joint], excused: set[str], values: Values
) -> None:
    roots = [name for name in links if name not in parents]
    if len(roots) < 2:
        return
    sizes = dict.fromkeys(roots, 0)
    for name in links:
        for _ in links:  # no path is longer than there are links, rings included
            if name not in parents:
                sizes[name] += 1
                break
            name = parents[name].parent
    main = max(roots, key=lambda name: (name not in excused, sizes[name]))
    for root in roots:
        if root != main and root not in excused:
            values.error(
                "U008",
                f"link '{root}' hangs on nothing: the robot's root is '{main}'",
                links[root].origin,
                f"join it by a joint whose child is '{root}'",
                (Related("the root", links[main].origin),),
            )
