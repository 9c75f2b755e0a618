"""Reads ROS 2 launch files in XML and YAML into the same actions that Python files create."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.quoting import split_words
from kbot.ros.launch.reporter import Reporter
from kbot.ros.launch.ros2 import actions as act
from kbot.ros.launch.ros2 import package_actions
from kbot.ros.launch.ros2 import substitutions as sub
from kbot.ros.launch.ros2.conditions import Condition, IfCondition, UnlessCondition
from kbot.ros.launch.ros2.substitutions import CommandLine
from kbot.ros.parameter_values import ROSPARAM
from kbot.text import DescriptionError, Diagnostic, Element, Origin, Severity, Source, Span, Text, parse_xml
from kbot.text.suggest import did_you_mean
from kbot.text.yaml import TEXT, Keys, YamlDocument, YamlError, load_yaml, read_yaml

_LISTS = {"arg", "let", "param", "remap", "env", "keep"}


def read_xml(source: Source, reporter: Reporter) -> list[object]:
    """The actions of a launch file in XML.

    Raises:
        DescriptionError: P001 to P003, or L001: it is not a launch file.
    """
    root = parse_xml(source)
    if root.tag != "launch":
        raise DescriptionError([_not_a_launch_file(Origin(root.origin.span))])
    return _Markup(reporter).actions(root)


def read_yaml_launch(source: Source, reporter: Reporter) -> list[object]:
    """The actions of a launch file in YAML.

    Raises:
        DescriptionError: L033, it is not YAML; L001, it is not a launch file.
    """
    try:
        document = read_yaml(source, TEXT)
    except YamlError as error:
        message = f"the YAML cannot be read: {error.problem}"
        raise DescriptionError([Diagnostic("L033", Severity.ERROR, message, Origin(error.span))]) from None
    if isinstance(document.data, dict) and "launch" in document.data:
        root = Element("launch", {}, source, 0, len(source.data))
        root.children.extend(_elements(document, document.data["launch"], ("launch",)))
        return _Markup(reporter).actions(root)
    raise DescriptionError([_not_a_launch_file(Origin(source.whole()))])


def _not_a_launch_file(origin: Origin) -> Diagnostic:
    return Diagnostic("L001", Severity.ERROR, "not a launch file", origin, "the root must be 'launch'")


def _elements(document: YamlDocument, items: object, keys: Keys) -> list[Element | Text]:
    """The XML elements for a list of mappings with one key, which is at `keys` in the document."""
    return [
        _element(document, tag, value, document.span(*keys, str(number), tag), (*keys, str(number), tag))
        for number, item in enumerate(items if isinstance(items, list) else [])
        for tag, value in (item.items() if isinstance(item, dict) else ())
    ]


def _element(document: YamlDocument, tag: str, value: object, key: Span, keys: Keys) -> Element:
    """The XML element for the value at `keys`. It begins at the span `key`."""
    place = document.place(*keys)
    element = Element(tag, {}, document.source, key.start, place.value.end if place else key.end)
    if isinstance(value, str):
        # for example `push_ros_namespace: NAME`
        element.attributes["namespace" if "namespace" in tag else "value"] = value
    elif isinstance(value, list):  # for example `group: [...]`
        element.children.extend(_elements(document, value, keys))
    elif isinstance(value, dict):
        for name, part in value.items():
            below = (*keys, name)
            if isinstance(part, str):
                element.attributes[name] = part
            elif name == "children":
                element.children.extend(_elements(document, part, below))
            elif name in _LISTS and isinstance(part, list):
                span = document.span(*below)
                element.children.extend(
                    _element(document, name, child, span, (*below, str(number)))
                    for number, child in enumerate(part)
                )
    return element


def _on_exit(element: Element) -> act.Shutdown | None:
    return act.Shutdown() if element.attributes.get("on_exit") == "shutdown" else None


class _Markup:
    def __init__(self, reporter: Reporter) -> None:
        self.reporter = reporter
        self._makers: Mapping[str, Callable[[Element], act.Action]] = {
            "arg": self._arg,
            "let": lambda e: act.SetLaunchConfiguration(self._of(e, "name"), self._of(e, "value")),
            "set_env": lambda e: act.SetEnvironmentVariable(self._of(e, "name"), self._of(e, "value")),
            "unset_env": lambda e: act.UnsetEnvironmentVariable(self._of(e, "name")),
            "append_env": self._append_env,
            "set_use_sim_time": lambda e: act.SetUseSimTime([self._of(e, "value")]),
            "ros_timer": lambda e: act.TimerAction(period=self._of(e, "period"), actions=self.actions(e)),
            "gz_server": lambda e: package_actions.gz_server(**self._all(e)),
            "ros_gz_bridge": lambda e: package_actions.ros_gz_bridge(**self._all(e)),
            "gz_spawn_model": lambda e: package_actions.gz_spawn_model(**self._all(e)),
            "set_ros_log_dir": lambda e: act.Silent(),
            "include": self._include,
            "group": self._group,
            "node": self._node,
            "executable": self._executable,
            "timer": lambda e: act.TimerAction(period=self._of(e, "period"), actions=self.actions(e)),
            "push_ros_namespace": lambda e: act.PushRosNamespace(self._of(e, "namespace")),
            "push-ros-namespace": lambda e: act.PushRosNamespace(self._of(e, "namespace")),
            "set_remap": lambda e: act.SetRemap(self._of(e, "from"), self._of(e, "to")),
            "set_parameter": lambda e: act.SetParameter(self._of(e, "name"), [self._of(e, "value")]),
            "set_parameters_from_file": lambda e: act.SetParametersFromFile(self._of(e, "filename")),
            "log": lambda e: act.LogInfo(),
            "shutdown": lambda e: act.Shutdown(),
            "composable_node": lambda e: act.Silent(),
            "load_composable_node": lambda e: act.Silent(),
            "node_container": lambda e: act.Silent(),
            "reset": lambda e: act.ResetLaunchConfigurations(dict(self._pairs(e, "keep"))),
        }

    def actions(self, parent: Element) -> list[object]:
        """The actions of an element's children, each with its origin and condition."""
        made: list[object] = []
        for element in parent.elements():
            if element.tag == "keep":  # not an action: `group` and `reset` read it
                continue
            maker = self._makers.get(element.tag)
            if maker is None:
                hint = did_you_mean(element.tag, self._makers)
                message = f"unknown tag <{element.tag}>"
                self.reporter.problem("L002", message, element.origin, hint, warning=True)
                continue
            try:
                action = maker(element)
                action.condition = self._condition(element)
            except LaunchError as fault:
                self.reporter.fault(fault, element.origin)
            else:
                action.origin = element.origin
                made.append(action)
        return made

    def _of(self, element: Element, name: str) -> object:
        if name not in element.attributes:
            raise LaunchError("L004", f"<{element.tag}> needs the attribute '{name}'")
        return parse(element.attributes[name])

    def _get(self, element: Element, name: str) -> object:
        return parse(element.attributes[name]) if name in element.attributes else None

    def _all(self, element: Element) -> dict[str, Any]:  # Any: keywords of actions
        """All attributes except the conditions."""
        return {
            name: parse(text) for name, text in element.attributes.items() if name not in ("if", "unless")
        }

    def _pairs(self, element: Element, tag: str) -> list[tuple[object, object]]:
        return [(self._of(child, "name"), self._of(child, "value")) for child in element.elements(tag)]

    def _append_env(self, element: Element) -> act.Action:
        given = {key: self._of(element, key) for key in ("prepend", "separator") if key in element.attributes}
        return act.AppendEnvironmentVariable(self._of(element, "name"), self._of(element, "value"), **given)

    def _condition(self, element: Element) -> Condition | None:
        if "if" in element.attributes and "unless" in element.attributes:
            raise LaunchError("L006", "a tag cannot have both 'if' and 'unless'")
        if "if" in element.attributes:
            return IfCondition(parse(element.attributes["if"]))
        return (
            UnlessCondition(parse(element.attributes["unless"])) if "unless" in element.attributes else None
        )

    def _arg(self, element: Element) -> act.Action:
        if "name" not in element.attributes:
            raise LaunchError("L004", "<arg> needs the attribute 'name'")
        default, description = self._get(element, "default"), element.attributes.get("description")
        return act.DeclareLaunchArgument(
            element.attributes["name"], default_value=default, description=description
        )

    def _include(self, element: Element) -> act.Action:
        pairs = [
            (self._of(child, "name"), self._of(child, "value"))
            for child in element.elements()
            if child.tag in ("arg", "let")
        ]
        return act.IncludeLaunchDescription(self._of(element, "file"), launch_arguments=pairs)

    def _group(self, element: Element) -> act.Action:
        kept = self._pairs(element, "keep")
        return act.GroupAction(
            self.actions(element),
            scoped=self._get(element, "scoped") or "true",
            forwarding=self._get(element, "forwarding") or "true",
            launch_configurations=dict(kept),
        )

    def _node(self, element: Element) -> act.Action:
        parameters: list[Any] = []
        for child in element.elements("param"):
            if "from" in child.attributes:
                allow_substs = self._get(child, "allow_substs") or "false"
                file = act.ParameterFile(self._of(child, "from"), allow_substs=allow_substs)
                file.origin = child.origin
                parameters.append(file)
            else:
                parameters += self._parameters(child)
        return act.Node(
            package=self._of(element, "pkg"),
            executable=self._of(element, "exec"),
            name=self._get(element, "name"),
            namespace=self._get(element, "namespace") or self._get(element, "ns"),
            arguments=self._words(element, "args") + self._words(element, "ros_args"),
            output=element.attributes.get("output", "log"),
            respawn=self._get(element, "respawn") or "false",
            respawn_delay=self._get(element, "respawn_delay"),
            prefix=self._get(element, "launch-prefix"),
            parameters=parameters,
            remappings=[(self._of(c, "from"), self._of(c, "to")) for c in element.elements("remap")],
            additional_env={
                child.attributes.get("name", ""): self._of(child, "value")
                for child in element.elements("env")
            },
            on_exit=_on_exit(element),
        )

    def _executable(self, element: Element) -> act.Action:
        return act.ExecuteProcess(
            cmd=self._words(element, "cmd") + self._words(element, "args"),
            name=self._get(element, "name"),
            on_exit=_on_exit(element),
        )

    def _parameters(self, element: Element, above: str = "") -> Iterator[act.PlacedParameter]:
        """The parameter of a `<param>`, or those nested in it, with names like `a.b`."""
        name = above + element.attributes.get("name", "")
        nested = list(element.elements("param"))
        for child in nested:
            yield from self._parameters(child, f"{name}.")
        if nested:
            return
        type_ = str if element.attributes.get("type") == "str" else None
        text = element.attributes.get("value", "")
        is_plain = "$(" not in text and type_ is None
        value = (
            load_yaml(text, ROSPARAM)
            if is_plain
            else act.ParameterValue(self._of(element, "value"), value_type=type_)
        )
        yield act.PlacedParameter({name: value}, element.origin)

    def _words(self, element: Element, name: str) -> list[object]:
        text = element.attributes.get(name, "")
        return [CommandLine([parse(text)])] if text else []


_MAKERS: dict[str, Callable[..., sub.Substitution]] = {
    "var": sub.LaunchConfiguration,
    "env": lambda name, default=None: sub.EnvironmentVariable(name, default_value=default),
    "optenv": lambda name, *rest: sub.EnvironmentVariable(
        name, default_value=sub.Sequence([word for part in rest for word in (part, " ")][:-1])
    ),
    "find-pkg-share": sub.FindPackageShare,
    "find-pkg-prefix": sub.FindPackagePrefix,
    "find-exec": lambda name: sub.FindExecutable(name=name),
    "exec-in-pkg": lambda name, package: sub.FindExecutable(name=name),
    "anon": sub.AnonName,
    "dirname": sub.ThisLaunchFileDir,
    "filename": sub.ThisLaunchFile,
    "not": sub.NotSubstitution,
    "and": sub.AndSubstitution,
    "or": sub.OrSubstitution,
    "equals": sub.EqualsSubstitution,
    "not-equals": sub.NotEqualsSubstitution,
    "any": sub.AnySubstitution,
    "all": sub.AllSubstitution,
    "file-content": sub.FileContent,
    "param": sub.Parameter,
    "launch_log_dir": sub.LaunchLogDir,
    "log_dir": sub.LaunchLogDir,
    "path-join": lambda *parts: sub.PathJoinSubstitution(parts),
    "if": lambda condition, yes="", no="": sub.IfElseSubstitution(condition, yes, no),
}


_ESCAPED = re.compile(r"\\(.)", re.DOTALL)


_WHOLE: dict[str, Callable[..., sub.Substitution]] = {"command": sub.Command, "eval": sub.PythonExpression}


def parse(text: str) -> sub.Substitution:
    """The substitution for a text with `$(…)`.

    Raises:
        LaunchError: L010, a `$(…)` is unknown; L015, one is malformed.
    """
    parts, at = _parts(text, 0, inside=False)
    if at != len(text):
        raise LaunchError("L015", "a ')' without its '$('", "", text[at:])
    return sub.Sequence(parts)


def _parts(text: str, at: int, *, inside: bool) -> tuple[list[object], int]:
    """The texts and substitutions from `at` to the end or, `inside` a `$(…)`, to its ')'. Also returns where
    they end."""
    parts: list[object] = []
    plain: list[str] = []
    depth = 0
    while at < len(text):
        if text.startswith("$(", at):
            if plain:
                parts.append("".join(plain))
                plain = []
            inner, end = _parts(text, at + 2, inside=True)
            if end >= len(text):
                raise LaunchError("L015", "a '$(' without its ')'", "", text[at:])
            parts.append(_made(inner, text[at : end + 1]))
            at = end + 1
            continue
        character = text[at]
        if character == "\\" and at + 1 < len(
            text
        ):  # inside a `$(…)`, escapes are kept until its quotes are read
            plain.append(text[at : at + 2] if inside else text[at + 1])
            at += 2
            continue
        if inside and character == ")" and depth == 0:
            break
        depth += (character == "(") - (character == ")") if inside else 0
        plain.append(character)
        at += 1
    if plain:
        parts.append("".join(plain))
    return parts, at


def _made(inner: list[object], whole: str) -> sub.Substitution:
    head = inner[0] if inner and isinstance(inner[0], str) else ""
    word, _, rest = head.strip().partition(" ") if len(inner) == 1 else head.lstrip().partition(" ")
    if word in _WHOLE:
        pieces = [rest.lstrip(), *inner[1:]]
        if isinstance(pieces[0], str) and pieces[0][:1] in "'\"" and pieces[0]:
            pieces = _unquoted(pieces)
        texts = [_ESCAPED.sub(r"\1", piece) if isinstance(piece, str) else piece for piece in pieces]
        return _WHOLE[word](sub.Sequence(texts))
    if word not in _MAKERS:
        known = [*_MAKERS, *_WHOLE]
        raise LaunchError("L010", f"unknown substitution $({word})", did_you_mean(word, known), whole)
    arguments = _split([rest, *inner[1:]], whole)
    try:
        return _MAKERS[word](*arguments)
    except TypeError:
        message = f"$({word} …) does not take {len(arguments)} values"
        raise LaunchError("L015", message, "", whole) from None


def _unquoted(pieces: list[object]) -> list[object]:
    """The pieces without the quotes around the whole."""
    first, last = pieces[0], pieces[-1]
    if isinstance(first, str) and isinstance(last, str) and last.rstrip().endswith(first[0]):
        if len(pieces) == 1:
            return [first.strip()[1:-1]]
        return [first[1:], *pieces[1:-1], last.rstrip()[:-1]]
    return pieces


def _split(pieces: list[object], whole: str) -> list[object]:
    """The values of a substitution, which are separated by spaces. Each consists of texts and
    substitutions."""
    values: list[list[object]] = []
    joined = False
    for piece in pieces:
        if not isinstance(piece, str):
            if joined and values:
                values[-1].append(piece)
            else:
                values.append([piece])
            joined = True
            continue
        try:
            words = split_words(piece)
        except ValueError:
            raise LaunchError("L015", "a quote is not closed", "", whole) from None
        for number, word in enumerate(words):
            if number == 0 and joined and not piece[:1].isspace():
                values[-1].append(word)
            else:
                values.append([word])
        joined = bool(words) and not piece[-1:].isspace()
    return [sub.Sequence(value) for value in values]
