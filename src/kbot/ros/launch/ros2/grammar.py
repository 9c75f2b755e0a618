"""The substitutions of ROS 2's XML and YAML: `$(var x)`, `$(find-pkg-share p)`, one within another."""

from __future__ import annotations

import re
from collections.abc import Callable

from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.quoting import split_words
from kbot.ros.launch.ros2 import substitutions as sub
from kbot.text.suggest import did_you_mean

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
    """A text with its `$(…)` taken apart.

    Raises:
        LaunchError: L010 an unknown one, L015 one that is malformed.
    """
    parts, at = _parts(text, 0, inside=False)
    if at != len(text):
        raise LaunchError("L015", "a ')' without its '$('", "", text[at:])
    return sub.Sequence(parts)


def _parts(text: str, at: int, *, inside: bool) -> tuple[list[object], int]:
    """Texts and substitutions from `at` on: to the end, or to the ')' that closes one."""
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
        if character == "\\" and at + 1 < len(text):  # within one, quotes are yet to be told from text
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
    """The pieces without the quotes around all of them."""
    first, last = pieces[0], pieces[-1]
    if isinstance(first, str) and isinstance(last, str) and last.rstrip().endswith(first[0]):
        if len(pieces) == 1:
            return [first.strip()[1:-1]]
        return [first[1:], *pieces[1:-1], last.rstrip()[:-1]]
    return pieces


def _split(pieces: list[object], whole: str) -> list[object]:
    """The values of a substitution: words apart by spaces, each of texts and substitutions."""
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
