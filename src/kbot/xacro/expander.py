"""Expands a description: walks the source tree and builds the result tree.

The source tree is not changed, so that parsed files can be cached. Every node of the result stores where it
was written and which calls led to it. After an error in a tag or attribute, the walk continues with the
next one. The functions of the xacro tags are in `kbot.xacro.tags`.
"""

from __future__ import annotations

from collections.abc import Callable

from kbot.text.span import Call
from kbot.text.xml import Comment, Element, Text
from kbot.xacro.binding import FAILED, Binding
from kbot.xacro.comments import Gap
from kbot.xacro.expansion_context import ExpansionContext, Node
from kbot.xacro.macros import MacroTable
from kbot.xacro.run import Run
from kbot.xacro.scope import Scope
from kbot.xacro.templates import evaluate, shortened
from kbot.xacro.values import Value, truth
from kbot.xacro.xacro_error import Problem, XacroError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_EVALUATED = 32
"""Characters charged for each evaluated text on top of its own: evaluating an empty text takes time too."""

Handler = Callable[["Expander", Element, ExpansionContext, bool], None]
"""Executes a tag. Arguments: the expander, the tag, the place, and whether a node follows the tag."""


class Expander:
    """Expands trees within one run.

    tags        the handlers of xacro's own tags, by name
    call_macro  the handler of all other tags with the prefix xacro
    overrides   values that replace those of top-level properties
    """

    def __init__(
        self, run: Run, tags: Mapping[str, Handler], call_macro: Handler, overrides: dict[str, Value]
    ) -> None:
        self.run = run
        self.tags = tags
        self._call_macro = call_macro
        self.gap = Gap()
        self.overrides = overrides
        self.overridden: set[str] = set()
        self.macros = MacroTable()

    def root(self, element: Element, scope: Scope) -> Element:
        """Expand a whole document."""
        made = element.childless_copy(None, element.tag, {})
        attributes = self.attributes(element, scope, None, made)
        target = element.attributes.get("xacro:targetNamespace")
        if target:
            attributes["xmlns"] = target
            if "$" in target:
                attributes["xmlns"] = self._attribute(
                    element, "xacro:targetNamespace", target, scope, None, made
                )
        self.children(
            element.children, ExpansionContext(scope, self.macros, None, attributes, made.children, made)
        )
        return made

    def children(self, nodes: Sequence[Node], place: ExpansionContext) -> None:
        """Expand nodes into `place.out`."""
        run = self.run
        out, depth, macro_depth = place.out, run.depth, run.macro_depth
        run.nodes -= len(nodes)
        evaluate_comments = False
        last = len(nodes) - 1
        for index, node in enumerate(nodes):
            if isinstance(node, Element):
                evaluate_comments = False
                if node.is_plain:
                    out.append(self._plain(node, place.call))
                elif not node.tag.startswith("xacro:"):
                    out.append(self.element(node, place))
                else:
                    try:
                        self.tag(node, place, index < last)
                    except XacroError as fault:
                        run.report(fault, node, "", place.call)
                        run.depth, run.macro_depth = depth, macro_depth
            elif type(node) is Text:
                if "$" in node.value:
                    node = self._text(node, place)
                elif node is self.gap.node:
                    node = Text("\n\n", node.source, 0, 0)
                out.append(node)
                if evaluate_comments and node.value.strip():
                    evaluate_comments = False
            elif type(node) is Comment:
                if "xacro:eval-comments" in node.value:
                    evaluate_comments = "xacro:eval-comments:off" not in node.value
                else:
                    out.append(self._comment(node, place) if evaluate_comments else node)
            else:
                out.append(node)

    def element(self, node: Element, place: ExpansionContext) -> Element:
        """Expand an element that is not a xacro tag."""
        run, call = self.run, place.call
        depth = run.depth
        run.depth = depth + 1
        if run.nodes < 0 or depth > run.deepest:
            self._check_bounds(depth, node, place)
        made = Element(node.tag, {}, node.source, node.start, node._close, call)
        attributes = self.attributes(node, place.scope, call, made)
        if node.children:
            # the children reuse the place: a new object for each element costs too much time
            saved = place.attributes, place.out, place.parent
            place.attributes, place.out, place.parent = attributes, made.children, made
            self.children(node.children, place)
            place.attributes, place.out, place.parent = saved
        run.depth = depth
        return made

    def _plain(self, node: Element, call: Call | None) -> Element:
        """An element without anything to expand. The result shares it with the parsed file if possible."""
        if call is None:
            return node
        self.run.nodes -= len(node.children)
        made = Element(node.tag, node.attributes, node.source, node.start, node._close, call)
        made.is_plain = True
        children: list[Node] = []
        for child in node.children:
            if isinstance(child, Element):
                child = self._plain(child, call)
            elif type(child) is Text and not child.value.isspace():
                child = child.with_call(call)
            children.append(child)
        made.children = children
        return made

    def tag(self, node: Element, place: ExpansionContext, has_next: bool) -> None:
        """Execute a xacro tag."""
        run = self.run
        run.depth += 1
        if run.nodes < 0 or run.depth > run.deepest:
            self._check_bounds(run.depth, node, place)
        self.tags.get(node.tag, self._call_macro)(self, node, place, has_next)
        run.depth -= 1

    def _check_bounds(self, depth: int, node: Element, place: ExpansionContext) -> None:
        """Report a LimitFault if there are too many nodes, or if they are nested too deeply."""
        run = self.run
        run.deepest = max(run.deepest, depth)
        if run.nodes < 0:
            fault = run.budget.exceeded("nodes", "the result has too many elements")
        elif depth > run.limits.nesting:
            fault = run.budget.exceeded("nesting", "elements and macro calls are nested too deeply")
        else:
            return
        run.report(fault, node, "", place.call)

    # --- texts and attributes ----------------------------------------------------------------

    def attributes(self, node: Element, scope: Scope, call: Call | None, made: Element) -> dict[str, str]:
        """Set the evaluated attributes of `node` on `made`, without xacro's own."""
        attributes = made.attributes
        for name, value in node.attributes.items():
            if "$" in value:
                if name.startswith("xacro:"):
                    continue
                value = self._attribute(node, name, value, scope, call, made)
            elif ":" in name and (name.startswith("xacro:") or name == "xmlns:xacro"):
                continue
            attributes[name] = value
        if node.moved:
            made.moved = node.moved
        if node.inputs:  # a block is expanded again where it is inserted, without its expressions
            made.inputs = {**node.inputs, **(made.inputs or {})}
        return attributes

    def _attribute(
        self, node: Element, name: str, text: str, scope: Scope, call: Call | None, made: Element
    ) -> str:
        run = self.run
        used = run.used
        used.clear()
        try:
            value = evaluate(text, scope)
            if type(value) is not str:
                value = run.budget.text(value)
        except XacroError as fault:
            run.report(fault, node, name, call)
            return text
        if used:
            if made.inputs is None:
                made.inputs = {}
            made.inputs[name] = tuple(used)
        if run.pending:
            run.flush(node, name, call)
        self._count(value, node, call)
        return str(value)

    def _count(self, value: str, node: Node, call: Call | None) -> None:
        run = self.run
        run.characters -= len(value) + _EVALUATED
        if run.characters < 0:
            run.report(run.budget.exceeded("text", "the evaluated texts are too long"), node, "", call)

    def _text(self, node: Text, place: ExpansionContext) -> Text:
        run = self.run
        run.used.clear()
        try:
            value = run.budget.text(evaluate(node.value, place.scope))
        except XacroError as fault:
            run.report(fault, node, "", place.call)
            return node
        if run.pending:
            run.flush(node, "", place.call)
        self._count(value, node, place.call)
        made = node.with_call(place.call, value)
        made.inputs = tuple(run.used)
        return made

    def _comment(self, node: Text, place: ExpansionContext) -> Text:
        made = self._text(node, place) if "$" in node.value else node
        if "--" in made.value:
            fault = XacroError(
                "X134", "the evaluated comment contains '--', which XML does not allow in comments"
            )
            self.run.report(fault, node, "", place.call)
        return made

    def evaluated(self, node: Element, name: str, place: ExpansionContext) -> Value:
        """The value of an attribute of a xacro tag.

        Raises:
            XacroError: the attribute has an error, which is already reported.
        """
        text = node.attributes[name]
        if "$" not in text:
            return text
        try:
            value = evaluate(text, place.scope)
        except XacroError as fault:
            raise self.reported(fault, node, name, place) from None
        if self.run.pending:
            self.run.flush(node, name, place.call)
        return value

    def truth(self, value: Value, node: Element, name: str, place: ExpansionContext) -> bool:
        """Whether an attribute's value is true.

        Raises:
            XacroError: the value is neither true nor false. The error is already reported.
        """
        try:
            return truth(value)
        except (ValueError, TypeError):
            text, result = shortened(node.attributes[name], 60), shortened(self.run.budget.text(value), 60)
            shown = f"'{text}' is" if text == result else f"'{text}' evaluates to '{result}', which is"
            from kbot.xacro.inserted_texts import comparison  # only for an error: start-up time

            right = comparison(node.attributes[name])
            hint = f"write {right}" if right else "write true, false, or a comparison: ${a == b}"
            fault = XacroError("X128", f"{shown} neither true nor false", hint)
            raise self.reported(fault, node, name, place) from None

    # --- for the modules of the tags ---------------------------------------------------------

    def reported(self, fault: XacroError, node: Element, name: str, place: ExpansionContext) -> XacroError:
        """Report a fault of an attribute. Raise the result to leave the tag without a second report."""
        problem = self.run.report(fault, node, name, place.call)
        return XacroError(fault.code, fault.message, problem=problem, origin=fault.origin)

    def poison(
        self, name: str, scope: Scope, node: Element, place: ExpansionContext, problem: Problem
    ) -> None:
        """Bind a name to a problem, so that its uses are not reported as further errors."""
        binding = Binding(name, None, FAILED, node, "", place.call)
        binding.problem = problem
        scope.values[name] = binding

    def splice(self, content: list[Node], place: ExpansionContext) -> None:
        """Append nodes to the place."""
        place.out.extend(content)
        self.gap.spliced(content, place.out)

    def replace(self, content: list[Node], place: ExpansionContext, has_next: bool) -> None:
        """Replace a tag by its content, and remove the comments before the tag."""
        tail: list[Node] = []
        self.gap.drop_comments(place.out, tail, has_next)
        self.splice(content, place)
        self.splice(tail, place)

    def lift(self, attributes: dict[str, str], place: ExpansionContext, node: Element) -> None:
        """Move namespace declarations to the enclosing element."""
        for name, value in attributes.items():
            if name.startswith("xmlns:"):
                old = place.attributes.setdefault(name, value)
                if old != value:
                    message = f"{name} is declared twice, as '{old}' and as '{value}'"
                    self.run.warn_at("X205", message, node.origin)
