"""The walk over a description that expands it: a tree goes in, another tree comes out.

Nothing of the tree that goes in is changed, so that parsed files can be kept and used again.
Every node of the result knows where it was written and which calls brought it. What is wrong with
one tag or attribute is reported, and the walk goes on with the next.
"""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Callable, Sequence

from kbot.text.errors import DescriptionError
from kbot.text.span import Call, Span
from kbot.text.suggest import did_you_mean
from kbot.text.xml import Comment, Element, Text
from kbot.xacro.comments import Gap
from kbot.xacro.faults import Fault, LimitFault, Problem
from kbot.xacro.files import parsed
from kbot.xacro.location import name_span
from kbot.xacro.macros import Macro, MacroTable, Parameter, parse_parameters
from kbot.xacro.run import Run
from kbot.xacro.scope import FAILED, LAZY, READY, Binding, Scope
from kbot.xacro.expressions import is_identifier
from kbot.xacro.templates import evaluate
from kbot.xacro.values import Value, truth

Node = Element | Text
_GLOB = re.compile(r"[*[?]")


class Place:
    """Where the walk is: whose names are seen, what brought it here, and where the result goes.

    `attributes` are those of the element whose children are being made.
    """

    __slots__ = ("attributes", "call", "macros", "out", "scope")

    def __init__(
        self, scope: Scope, macros: MacroTable, call: Call | None, attributes: dict[str, str], out: list[Node]
    ) -> None:
        self.scope = scope
        self.macros = macros
        self.call = call
        self.attributes = attributes
        self.out = out


class Expander:
    """Expands trees within one run."""

    def __init__(self, run: Run, overrides: dict[str, Value]) -> None:
        self.run = run
        self.gap = Gap()
        self.overrides = overrides
        self.overridden: set[str] = set()

    def root(self, element: Element, scope: Scope) -> Element:
        """Expand a whole document."""
        made = element.made_by(None, element.tag, {})
        attributes = self._attributes(element, scope, None, made)
        target = element.attributes.get("xacro:targetNamespace")
        if target:
            attributes["xmlns"] = target if "$" not in target else self._attribute(
                element, "xacro:targetNamespace", target, scope, None, made
            )
        self.children(element.children, Place(scope, MacroTable(), None, attributes, made.children))
        return made

    def children(self, nodes: Sequence[Node], place: Place) -> None:
        """Expand nodes into `place.out`."""
        run = self.run
        out, depth, macro_depth = place.out, run.depth, run.macro_depth
        evaluate_comments = False
        last = len(nodes) - 1
        for index, node in enumerate(nodes):
            kind = type(node)
            if kind is Element:
                evaluate_comments = False
                if node.is_plain:
                    out.append(self._plain(node, place.call))
                    continue
                if not node.tag.startswith("xacro:"):
                    out.append(self._element(node, place))
                    continue
                try:
                    self._tag(node, place, index < last)
                except Fault as fault:
                    run.report(fault, node, "", place.call)
                    run.depth, run.macro_depth = depth, macro_depth
            elif kind is Text:
                value = node.value
                if "$" in value:
                    node = self._text(node, place)
                    value = node.value
                elif node is self.gap.node:
                    node = Text("\n\n", node.source, 0, 0)
                out.append(node)
                if evaluate_comments and value.strip():
                    evaluate_comments = False
            elif kind is Comment:
                if "xacro:eval-comments" in node.value:
                    evaluate_comments = "xacro:eval-comments:off" not in node.value
                else:
                    out.append(self._comment(node, place) if evaluate_comments else node)
            else:
                out.append(node)

    def _element(self, node: Element, place: Place) -> Element:
        """Expand an element that is none of xacro's own."""
        run, call = self.run, place.call
        run.nodes -= 1
        depth = run.depth
        run.depth = depth + 1
        if run.nodes < 0 or depth > run.limits.nesting:
            self._exceeded(node, place)
        attributes: dict[str, str] = {}
        made = Element(node.tag, attributes, node.source, node.start, node._close, call)
        self._attributes(node, place.scope, call, made)
        if node.children:
            around, place.attributes = place.attributes, attributes
            out, place.out = place.out, made.children
            self.children(node.children, place)
            place.attributes, place.out = around, out
        run.depth = depth
        return made

    def _plain(self, node: Element, call: Call | None) -> Element:
        """An element in which there is nothing to expand; shared with the parsed file where it can be."""
        if call is None:
            return node
        self.run.nodes -= 1
        made = Element(node.tag, node.attributes, node.source, node.start, node._close, call)
        made.is_plain = True
        if node.children:
            made.children = [
                self._plain(child, call)
                if type(child) is Element
                else child if type(child) is not Text or child.value.isspace() else child.brought_by(call)
                for child in node.children
            ]
        return made

    def _exceeded(self, node: Element, place: Place) -> None:
        run = self.run
        name, what = ("nodes", "the result has too many elements") if run.nodes < 0 else (
            "nesting", "elements and macro calls are nested too deeply"
        )
        run.report(run.budget.exceeded(name, what), node, "", place.call)

    def _attributes(self, node: Element, scope: Scope, call: Call | None, made: Element) -> dict[str, str]:
        """Give `made` the attributes of an element, evaluated, without those that are xacro's."""
        attributes = made.attributes
        for name, value in node.attributes.items():
            if "$" in value:
                if name.startswith("xacro:"):
                    continue
                value = self._attribute(node, name, value, scope, call, made)
            elif ":" in name and (name.startswith("xacro:") or name == "xmlns:xacro"):
                continue
            attributes[name] = value
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
        except Fault as fault:
            run.report(fault, node, name, call)
            value = text
        if used:
            if made.fed is None:
                made.fed = {}
            made.fed[name] = tuple(used)
        if run.pending:
            run.flush(node, name, call)
        self._count(value, node, call)
        return value

    def _count(self, value: str, node: Node, call: Call | None) -> None:
        run = self.run
        run.characters -= len(value)
        if run.characters < 0:
            run.report(run.budget.exceeded("text", "the evaluated texts are too long"), node, "", call)

    def _text(self, node: Text, place: Place) -> Text:
        run = self.run
        try:
            value = evaluate(node.value, place.scope)
            if type(value) is not str:
                value = run.budget.text(value)
        except Fault as fault:
            run.report(fault, node, "", place.call)
            return node
        if run.pending:
            run.flush(node, "", place.call)
        self._count(value, node, place.call)
        return node.brought_by(place.call, value)

    def _comment(self, node: Text, place: Place) -> Text:
        made = self._text(node, place) if "$" in node.value else node
        if "--" in made.value or made.value.endswith("-"):
            fault = Fault("X134", "the evaluated comment holds '--', which XML does not allow in one")
            self.run.report(fault, node, "", place.call)
        return made

    def _evaluated(self, node: Element, name: str, place: Place) -> Value:
        """The value of an attribute of a xacro tag. A fault of it gets its place."""
        text = node.attributes[name]
        if "$" not in text:
            return text
        try:
            value = evaluate(text, place.scope)
        except Fault as fault:
            problem = self.run.report(fault, node, name, place.call)
            raise Fault(fault.code, fault.message, problem=problem, origin=fault.origin) from None
        if self.run.pending:
            self.run.flush(node, name, place.call)
        return value

    # --- xacro's own tags --------------------------------------------------------------------

    def _tag(self, node: Element, place: Place, has_next: bool) -> None:
        run = self.run
        run.nodes -= 1
        run.depth += 1
        if run.nodes < 0 or run.depth > run.limits.nesting:
            self._exceeded(node, place)
        handler = _HANDLERS.get(node.tag)
        if handler is None:
            self._macro_call(node, place, has_next)
        else:
            handler(self, node, place, has_next)
        run.depth -= 1

    def _check(self, node: Element, place: Place, required: tuple[str, ...], optional: tuple[str, ...] = ()) -> None:
        """Refuse a tag without its attributes; warn of those that it does not have."""
        if tuple(node.attributes) == required:
            return
        attributes = node.attributes
        unknown = [
            name
            for name in attributes
            if name not in required and name not in optional and not name.startswith("xmlns:")
        ]
        for name in required:
            if name not in attributes:
                hint = did_you_mean(name, unknown)
                raise Fault("X120", f"<{node.tag}> has no attribute '{name}'", hint and f"it has '{unknown[0]}'")
        for name in unknown:
            absent = [n for n in (*required, *optional) if n not in attributes]
            self.run.warn_at(
                "X203",
                f"<{node.tag}> has no use for the attribute '{name}'",
                name_span(node, name, place.call),
                did_you_mean(name, absent) or f"it takes {', '.join((*required, *optional))}",
            )

    def _replace(self, content: list[Node], place: Place, has_next: bool) -> None:
        """Put the content in a tag's place, and take the comments before the tag away."""
        tail: list[Node] = []
        self.gap.drop_comments(place.out, tail, has_next)
        self._splice(content, place)
        self._splice(tail, place)

    def _splice(self, content: list[Node], place: Place) -> None:
        place.out.extend(content)
        self.gap.spliced(content, place.out)

    def _if(self, node: Element, place: Place, has_next: bool) -> None:
        tail: list[Node] = []
        self.gap.drop_comments(place.out, tail, has_next)
        self._check(node, place, ("value",))
        try:
            keep = self._truth(node, "value", place)
        except Fault as fault:
            problem = self.run.report(fault, node, "value", place.call)
            self._forgive(node, place, problem)
            return
        if keep is not (node.tag == "xacro:unless"):
            content: list[Node] = []
            inner = Place(place.scope, place.macros, place.call, {}, content)
            self.children(node.children, inner)
            self._splice(content, place)
        self._splice(tail, place)

    def _truth(self, node: Element, name: str, place: Place) -> bool:
        value = self._evaluated(node, name, place)
        return self._as_truth(value, node, name, place)

    def _as_truth(self, value: Value, node: Element, name: str, place: Place) -> bool:
        try:
            return truth(value)
        except (ValueError, TypeError):
            text = node.attributes[name]
            shown = f"'{text}' is" if text == value else f"'{text}' gives '{value}', which is"
            fault = Fault("X128", f"{shown} neither true nor false", "write true, false, or a comparison: ${a == b}")
            problem = self.run.report(fault, node, name, place.call)
            raise Fault(fault.code, fault.message, problem=problem, origin=fault.origin) from None

    def _forgive(self, node: Element, place: Place, problem: Problem) -> None:
        """What a part that could not be expanded would have defined, is not to be missed."""
        for child in node.elements():
            name = child.attributes.get("name", "")
            if child.tag == "xacro:property" and name not in place.scope:
                binding = Binding(name, None, FAILED, child, "value", place.call)
                binding.problem = problem
                place.scope.values[name] = binding
            elif child.tag == "xacro:macro" and place.macros.find(name) is None:
                place.macros.own[name] = Macro(name, child, (), place.call, problem)
            elif child.tag in ("xacro:if", "xacro:unless"):
                self._forgive(child, place, problem)
            elif child.tag == "xacro:include":
                self.run.incomplete = self.run.incomplete or problem

    def _arg(self, node: Element, place: Place, has_next: bool) -> None:
        self._check(node, place, ("name", "default"))
        run, name = self.run, node.attributes["name"]
        run.declared.add(name)
        if name not in run.arguments:
            try:
                run.arguments[name] = run.budget.text(self._evaluated(node, "default", place))
            except Fault as fault:
                if fault.problem is not None:
                    run.failed_arguments[name] = fault.problem
        self.gap.drop_comments(place.out, place.out, has_next)

    def _property(self, node: Element, place: Place, has_next: bool) -> None:
        self.gap.drop_comments(place.out, place.out, has_next)
        run, scope, attributes = self.run, place.scope, node.attributes
        if tuple(attributes) == ("name", "value") and not self.overrides:
            name = attributes["name"]
            if is_identifier(name) and not name.startswith("__"):
                scope.define(Binding(name, attributes["value"], LAZY, node, "value", place.call))
                return
        self._check(node, place, ("name",), ("value", "default", "remove", "scope", "lazy_eval"))
        name = self._evaluated(node, "name", place)
        if type(name) is not str or not is_identifier(name):
            raise self._at(node, "name", place, Fault("X126", f"'{name}' is no valid property name"),
                           "letters, digits and underscores, no digit first, no word of Python's")
        if name.startswith("__"):
            raise self._at(node, "name", place, Fault("X126", f"the property name '{name}' begins with two underscores"))
        remove = "remove" in attributes and self._truth(node, "remove", place)
        if ("value" in attributes) + ("default" in attributes) + remove > 1:
            raise Fault("X127", f"value, default and remove exclude one another (property '{name}')")
        if remove and name in scope:
            scope.remove(name)
            return
        source = "value"
        if "default" in attributes:
            if "scope" in attributes:
                run.warn_at("X210", "a default is always of the local scope", name_span(node, "scope", place.call))
            if name in scope:
                return
            source = "default"
        lazy = "lazy_eval" not in attributes or self._truth(node, "lazy_eval", place)
        target = scope
        kind = attributes.get("scope")
        if kind == "global":
            target, lazy = scope.top(), False
        elif kind == "parent":
            target, lazy = self._parent(node, scope, place), False
        if source not in attributes:
            binding = Binding(f"**{name}", node, READY, node, "name", place.call)
        elif self.overrides and target.parent is None and name in self.overrides:
            self.overridden.add(name)
            binding = Binding(name, self.overrides[name], READY, node, source, place.call)
        else:
            binding = Binding(name, attributes[source], LAZY, node, source, place.call)
            if not lazy:
                self._compute(binding, node, source, place)
        target.define(binding)

    def _compute(self, binding: Binding, node: Element, source: str, place: Place) -> None:
        """Evaluate a property at once."""
        self.run.used.clear()
        try:
            binding.value = self._evaluated(node, source, place)
            binding.state = READY
            binding.fed = tuple(self.run.used)
        except Fault as fault:
            binding.problem = fault.problem
            binding.state = FAILED

    def _at(self, node: Element, attribute: str, place: Place, fault: Fault, hint: str = "") -> Fault:
        """A fault at an attribute's value."""
        fault.hint = fault.hint or hint
        fault.origin = node.attribute_origin(attribute)
        fault.origin = type(fault.origin)(fault.origin.span, place.call)
        return fault

    def _parent(self, node: Element, scope: Scope, place: Place) -> Scope:
        target = scope.parent
        if target is None:
            raise self._at(node, "scope", place, Fault("X132", "there is no scope around this one"),
                           'leave scope="parent" out')
        if not scope.is_namespace:
            while target.is_namespace and target.parent is not None:
                target = target.parent
        return target

    def _macro(self, node: Element, place: Place, has_next: bool) -> None:
        self.gap.drop_comments(place.out, place.out, has_next)
        self._check(node, place, ("name",), ("params",))
        name = node.attributes["name"]
        if name == "call":
            raise self._at(node, "name", place, Fault("X131", "no macro can be named 'call'"))
        if "." in name:
            raise self._at(node, "name", place, Fault("X131", f"the macro name '{name}' has a dot in it"),
                           "dots stand between a namespace and a macro")
        if name.startswith("xacro:"):
            self.run.warn_at("X209", f"the macro name '{name}' has the prefix 'xacro:'",
                             self._at(node, "name", place, Fault("", "")).origin, "leave the prefix out here")
            name = name[6:]
        macro = Macro(name, node, (), place.call)
        macro.is_plain = not any("$" in v or k.startswith("xmlns:") for k, v in node.attributes.items())
        try:
            macro.parameters = parse_parameters(node.attributes.get("params", ""))
        except ValueError as error:
            fault = self._at(node, "params", place, Fault("X131", str(error)))
            macro.problem = self.run.report(fault, node, "params", place.call)
        place.macros.own[name] = macro

    def _insert_block(self, node: Element, place: Place, has_next: bool) -> None:
        self._check(node, place, ("name",))
        name, scope = node.attributes["name"], place.scope
        binding = scope.find(f"**{name}")
        several = binding is not None
        if binding is None:
            binding = scope.find(f"*{name}")
        if binding is None:
            known = scope.find(name)
            if known is not None and known.state == FAILED and known.problem is not None:
                raise Fault("X129", "", problem=known.problem)
            hint = did_you_mean(name, scope.blocks()) or (
                f"'{name}' is a property with a value: write ${{{name}}}" if known else "")
            fault = Fault("X129", f"the block '{name}' is not defined", hint, key=("block", name))
            fault.near = bool(hint)
            raise self._at(node, "name", place, fault)
        block: Element = binding.value
        if not several:
            place.out.append(self._element(block, place))
            return
        scratch = block.made_by(place.call, block.tag, {})
        attributes = self._attributes(block, scope, place.call, scratch)
        content: list[Node] = []
        self.children(block.children, Place(scope, place.macros, place.call, attributes, content))
        self._splice(content, place)

    def _element_tag(self, node: Element, place: Place, has_next: bool) -> None:
        """xacro:element, an element whose name is computed."""
        if "xacro:name" not in node.attributes:
            raise Fault("X120", "<xacro:element> has no attribute 'xacro:name'")
        name = self._evaluated(node, "xacro:name", place)
        if not name:
            raise self._at(node, "xacro:name", place, Fault("X130", "the element's name is empty"))
        attributes = {key: value for key, value in node.attributes.items() if key != "xacro:name"}
        renamed = node.made_by(node.call, str(name), attributes)
        renamed.children = node.children
        if renamed.tag.startswith("xacro:"):
            self._tag(renamed, place, has_next)
        else:
            place.out.append(self._element(renamed, place))

    def _attribute_tag(self, node: Element, place: Place, has_next: bool) -> None:
        """xacro:attribute, an attribute of the element around whose name is computed."""
        for required in ("name", "value"):
            if required not in node.attributes:
                raise Fault("X120", f"<xacro:attribute> has no attribute '{required}'")
        name = self._evaluated(node, "name", place)
        value = self._evaluated(node, "value", place)
        if not name:
            raise self._at(node, "name", place, Fault("X130", "the attribute's name is empty"))
        # the official writer leaves out what is not a text and false
        text = "" if not value else self.run.budget.text(value)
        place.attributes[str(name)] = text

    # --- includes ----------------------------------------------------------------------------

    def _include(self, node: Element, place: Place, has_next: bool) -> None:
        run = self.run
        self._check(node, place, ("filename",), ("ns", "optional"))
        scope, macros = place.scope, place.macros
        if node.attributes.get("ns"):
            space = run.budget.text(self._evaluated(node, "ns", place))
            macros = MacroTable()
            scope = Scope(run, place.scope, is_namespace=True)
            place.macros.own[space] = macros
            place.scope.define(Binding(space, scope, READY, node, "ns", place.call))
        optional = "optional" in node.attributes and self._as_truth(node.attributes["optional"], node, "optional", place)
        if next(node.elements(), None) is not None:
            run.warn_at("X208", "what stands within <xacro:include> is ignored", node.origin)
        try:
            name = run.absolute(run.budget.text(self._evaluated(node, "filename", place)))
        except Fault as fault:
            if fault.problem is not None:
                run.incomplete = run.incomplete or fault.problem
            raise
        content: list[Node] = []
        for file in self._files(name, node, place):
            self._file(file, node, scope, macros, place, optional, content)
        self._replace(content, place, has_next)

    def _files(self, name: str, node: Element, place: Place) -> list[str]:
        names = [name]
        if _GLOB.search(name):
            names = sorted(glob.glob(name))
            if not names:
                self.run.warn_at("X204", f"no file matches '{name}'",
                                 self._at(node, "filename", place, Fault("", "")).origin)
        self.run.dependencies.update(dict.fromkeys(names))
        return names

    def _file(
        self, file: str, node: Element, scope: Scope, macros: MacroTable, place: Place, optional: bool, content: list[Node]
    ) -> None:
        run = self.run
        if len(run.files) > run.limits.includes:
            around = " -> ".join(os.path.basename(f) for f in run.files[-3:])  # noqa: PTH119
            raise run.budget.exceeded("includes", f"files include one another without end: {around}")
        call = Call("include", file, Span(node.source, node.start, node.tag_end), place.call)
        try:
            document = parsed(run.read(file))
        except DescriptionError as error:
            self._unreadable(error, file, node, place, optional, call)
            return
        run.files.append(file)
        if document.diagnostics:
            run.adopt(document.diagnostics, call)
        root = document.root
        made = root.made_by(call, root.tag, {})
        attributes = self._attributes(root, scope, call, made)
        inner: list[Node] = []
        self.children(root.children, Place(scope, macros, call, attributes, inner))
        content.extend(inner)
        self.gap.spliced(inner, content)
        self._lift(attributes, place, node)
        run.files.pop()

    def _unreadable(
        self, error: DescriptionError, file: str, node: Element, place: Place, optional: bool, call: Call
    ) -> None:
        run, cause = self.run, error.diagnostics[0]
        if cause.code.startswith("F"):
            if optional:
                return
            fault = Fault("X117", f"cannot include: {cause.message}", cause.hint)
            problem = run.report(fault, node, "filename", place.call)
        else:
            problem = run.adopt(error.diagnostics, call)
        run.incomplete = run.incomplete or problem

    def _lift(self, attributes: dict[str, str], place: Place, node: Element) -> None:
        """Bring the namespaces that were declared within up to the element around."""
        for name, value in attributes.items():
            if name.startswith("xmlns:"):
                old = place.attributes.setdefault(name, value)
                if old != value:
                    self.run.warn_at("X205", f"{name} is declared twice, as '{old}' and as '{value}'", node.origin)

    # --- macro calls -------------------------------------------------------------------------

    def _dynamic_call(self, node: Element, place: Place, has_next: bool) -> None:
        if not node.attributes.get("macro"):
            raise Fault("X120", "<xacro:call> has no attribute 'macro'")
        name = self.run.budget.text(self._evaluated(node, "macro", place))
        attributes = {key: value for key, value in node.attributes.items() if key != "macro"}
        renamed = node.made_by(node.call, f"xacro:{name}", attributes)
        renamed.children = node.children
        self._macro_call(renamed, place, has_next)

    def _macro_call(self, node: Element, place: Place, has_next: bool) -> None:
        run, scope = self.run, place.scope
        macro, macros, outer = self._find_macro(node, place)
        if macro.problem is not None:
            raise Fault("X131", "", problem=macro.problem)
        run.macro_depth += 1
        if run.macro_depth > run.limits.macro_calls:
            raise run.budget.exceeded("macro_calls", f"the macro '{macro.name}' calls itself without end")
        local = Scope(run, outer)
        missing = {parameter.name: parameter for parameter in macro.parameters}
        for name in node.attributes:
            if name not in missing:
                self._unknown_parameter(node, name, macro, place)
                continue
            del missing[name]
            binding = Binding(name, None, READY, node, name, place.call)
            self._compute(binding, node, name, place)
            local.define(binding)
        if node.children or any(name.startswith("*") for name in missing):
            self._blocks(node, macro, missing, local, place)
        if missing:
            self._defaults(node, macro, missing, local, scope, place)
        body = macro.body
        call = Call("macro", macro.name, Span(node.source, node.start, node.tag_end), place.call)
        attributes = self._body_attributes(macro, local)
        content: list[Node] = []
        inner = Place(local, MacroTable(macros), call, attributes, content)
        self.children(body.children, inner)
        if attributes:
            self._lift(attributes, place, node)
        self._replace(content, place, has_next)
        run.macro_depth -= 1

    def _body_attributes(self, macro: Macro, local: Scope) -> dict[str, str]:
        """The macro's own attributes, which are evaluated with every call: namespaces are lifted from them."""
        if macro.is_plain:
            return {}
        body = macro.body
        return self._attributes(body, local, macro.call, body.made_by(None, body.tag, {}))

    def _find_macro(self, node: Element, place: Place) -> tuple[Macro, MacroTable, Scope]:
        name = node.tag[6:]
        found = place.macros.find(name)
        macros, scope = place.macros, place.scope
        if found is None and "." in name:
            *spaces, last = name.split(".")
            for space in spaces:
                table = macros.find(space)
                binding = scope.find(space)
                if not isinstance(table, MacroTable) or binding is None or not isinstance(binding.value, Scope):
                    raise self._unknown_macro(name, place)
                macros, scope = table, binding.value
            found = macros.find(last)
        if not isinstance(found, Macro):
            raise self._unknown_macro(name, place)
        return found, macros, scope

    def _unknown_macro(self, name: str, place: Place) -> Fault:
        known = [*place.macros.names(), *(tag[6:] for tag in _HANDLERS)]
        near = did_you_mean(name, known)
        hint = near or f'define it before: <xacro:macro name="{name}">…</xacro:macro>, or include the file that does'
        fault = Fault("X121", f"there is no macro '{name}'", hint, key=("macro", name))
        fault.near = bool(near)
        return fault

    def _unknown_parameter(self, node: Element, name: str, macro: Macro, place: Place) -> None:
        names = [p.name for p in macro.parameters if not p.is_block]
        fault = Fault("X122", f"the macro '{macro.name}' has no parameter '{name}'", did_you_mean(name, names) or (
            f"its parameters are {', '.join(names)}" if names else "it has none"), origin=name_span(node, name, place.call))
        self.run.report(fault, node, name, place.call)

    def _blocks(
        self, node: Element, macro: Macro, missing: dict[str, Parameter], local: Scope, place: Place
    ) -> None:
        """Evaluate what stands within a call, and hand its elements to the block parameters in order."""
        content: list[Node] = []
        self.children(node.children, Place(place.scope, place.macros, place.call, {}, content))
        blocks = [child for child in content if type(child) is Element]
        wanted = [name for name in missing if name.startswith("*")]
        for name, block in zip(wanted, blocks, strict=False):
            local.define(Binding(name, block, READY, block, "", place.call))
        if len(wanted) > len(blocks):
            names = ", ".join(f"'{name.lstrip('*')}'" for name in wanted[len(blocks) :])
            fault = Fault("X124", f"the macro '{macro.name}' misses the block {names}",
                          f"write {len(wanted)} element{'s' * (len(wanted) > 1)} within the call")
            problem = self.run.report(fault, node, "", place.call)
            for name in wanted[len(blocks) :]:
                self._poison(name.lstrip("*"), local, node, place, problem)
        elif len(blocks) > len(wanted):
            extra = blocks[len(wanted)]
            takes = f"it takes {len(wanted)}" if wanted else "it takes none"
            fault = Fault("X125", f"the macro '{macro.name}' has no use for the block <{extra.tag}>", takes)
            self.run.report(fault, extra, "", place.call)
        for name in wanted:
            del missing[name]

    def _defaults(
        self, node: Element, macro: Macro, missing: dict[str, Parameter], local: Scope, scope: Scope, place: Place
    ) -> None:
        """Give the parameters left their defaults, evaluated in the scope of the call."""
        absent = []
        for name, parameter in missing.items():
            if not parameter.is_optional:
                absent.append(name)
                continue
            binding = Binding(name, parameter.default, READY, macro.body, "params", macro.call)
            known = scope.find(name) if parameter.forwarded else None
            try:
                if parameter.forwarded and (known is not None or name in scope):
                    binding.value = scope.lookup(name)
                elif parameter.default is not None:
                    binding.value = self._default(parameter.default, macro, scope)
                else:
                    raise Fault("X133", f"there is no '{name}' to forward to the macro '{macro.name}'",
                                origin=node.origin, key=("undefined", name))
            except Fault as fault:
                if known is not None and fault.problem is not None:
                    fault.origin = node.origin
                binding.problem = self.run.report(fault, macro.body, "params", place.call)
                binding.state = FAILED
            local.define(binding)
        if absent:
            names = ", ".join(f"'{name}'" for name in absent)
            given = [name for name in node.attributes if name not in {p.name for p in macro.parameters}]
            fault = Fault("X123", f"the macro '{macro.name}' misses the parameter{'s' * (len(absent) > 1)} {names}",
                          did_you_mean(absent[0], given) and f"'{given[0]}' was given")
            if not given:
                problem = self.run.report(fault, node, "", place.call)
            else:
                problem = self.run.problems[-1]
            for name in absent:
                self._poison(name, local, node, place, problem)

    def _default(self, text: str, macro: Macro, scope: Scope) -> Value:
        try:
            return evaluate(text, scope)
        except Fault as fault:
            at = macro.body.attributes["params"].find(text)
            if fault.part is not None:
                fault.part = (fault.part[0] + at, fault.part[1] + at)
            raise

    def _poison(self, name: str, scope: Scope, node: Element, place: Place, problem: Problem) -> None:
        """A name without a value, so that its uses are no errors of their own."""
        binding = Binding(name, None, FAILED, node, "", place.call)
        binding.problem = problem
        scope.values[name] = binding


Handler = Callable[[Expander, Element, Place, bool], None]
_HANDLERS: dict[str, Handler] = {
    "xacro:if": Expander._if,
    "xacro:unless": Expander._if,
    "xacro:property": Expander._property,
    "xacro:macro": Expander._macro,
    "xacro:include": Expander._include,
    "xacro:arg": Expander._arg,
    "xacro:insert_block": Expander._insert_block,
    "xacro:element": Expander._element_tag,
    "xacro:attribute": Expander._attribute_tag,
    "xacro:call": Expander._dynamic_call,
}
