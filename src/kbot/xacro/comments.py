"""Comments before a xacro tag are removed with it, unless a blank line separates them.

The official implementation has a single empty text node, and moves it to where it last stopped removing
comments. The node's position decides which comments stay, so KBot keeps such a node too.
"""

from __future__ import annotations

from kbot.text.span import Source
from kbot.text.xml import Comment, Element, Text

TYPE_CHECKING = False
if TYPE_CHECKING:
    Nodes = list[Element | Text]


class Gap:
    """The empty text node, and the list that contains it."""

    def __init__(self) -> None:
        self.node = Text("\n\n", Source("", ""), 0, 0)
        self._home: Nodes | None = None

    def drop_comments(self, out: Nodes, tail: Nodes, has_next: bool) -> None:
        """Remove the comments at the end of `out`, and append the gap to `tail`."""
        at = len(out)
        while at:
            last = out[at - 1]
            if type(last) is Text and last.value.isspace() and last.value.count("\n") <= 1:
                at -= 1
            if at and type(out[at - 1]) is Comment:
                at -= 1
                del out[at]
            else:
                self._insert(tail, has_next)
                return

    def _insert(self, out: Nodes, has_next: bool) -> None:
        if not has_next:
            return
        home = self._home
        if home is not None:
            for index in range(len(home) - 1, -1, -1):
                if home[index] is self.node:
                    del home[index]
                    break
        out.append(self.node)
        self._home = out

    def spliced(self, content: Nodes, out: Nodes) -> None:
        """Record that the nodes of `content` were appended to `out`."""
        if self._home is content:
            self._home = out
