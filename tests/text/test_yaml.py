"""The reader of YAML knows where each value was written, and where a text is wrong."""

import math

import pytest

from kbot.text import Source
from kbot.text.yaml import TEXT, Dialect, YamlError, load_yaml, read_yaml

TEXT_WITH_PLACES = """\
base: &b {k: 1, l: [é, 7]}
merged: {<<: *b, m: 2}
yes: 3
alias: *b
"""


@pytest.mark.parametrize(
    ("keys", "place"),
    [
        ((), (1, 1)),
        (("base", "l", "1"), (1, 24)),
        (("merged", "k"), (1, 11)),  # at the anchor
        (("merged", "m"), (2, 18)),
        (("True",), (3, 1)),  # YAML 1.1 reads it as a truth value
        (("alias",), (4, 1)),
        (("alias", "l", "0"), (1, 21)),
        (("merged", "absent", "x"), (2, 1)),  # the nearest value above
    ],
)
def test_each_value_has_a_span(keys: tuple[str, ...], place: tuple[int, int]) -> None:
    span = read_yaml(Source("a.yaml", TEXT_WITH_PLACES)).span(*keys)
    assert (span.line, span.column) == place


def test_a_place_has_the_spans_of_a_key_and_its_value() -> None:
    document = read_yaml(Source("a.yaml", TEXT_WITH_PLACES))
    place = document.place("merged", "m")
    assert place is not None
    assert place.key is not None
    assert (place.key.text, place.value.text) == ("m", "2")
    assert document.place("merged", "absent") is None
    assert read_yaml(Source("a.yaml", "")).place() is None


@pytest.mark.parametrize(
    ("text", "problem", "place"),
    [
        (
            "a: 1\nb: [",
            "while parsing a flow node, expected the node content, but found '<stream end>'",
            (2, 5),
        ),
        ("a: 1\nb: !!int ''", '"" is not a valid int', (2, 4)),
        ("a: 1\nb: 2020-13-45", '"2020-13-45" is not a valid timestamp', (2, 4)),
        ("a: 1\n? [b]\n: 1", "while constructing a mapping, found unhashable key", (2, 3)),
        ("a: 1\nb: !half x", "could not convert string to float: 'x'", (2, 4)),
        ("a: \0", "unacceptable character #x0000", (1, 1)),
        ("---\n1\n---\n2", "expected a single document in the stream, but found another document", (3, 1)),
    ],
)
def test_an_error_has_a_place(text: str, problem: str, place: tuple[int, int]) -> None:
    dialect = Dialect({"!half": lambda text: float(text) / 2})
    with pytest.raises(YamlError) as caught:
        read_yaml(Source("a.yaml", text), dialect)
    assert caught.value.problem.startswith(problem)
    assert (caught.value.span.line, caught.value.span.column) == place


def test_a_dialect_says_what_scalars_are() -> None:
    assert read_yaml(Source("a.yaml", "a: [1, yes, 2020-01-01]"), TEXT).data == {
        "a": ["1", "yes", "2020-01-01"]
    }
    assert load_yaml("!degrees 180", Dialect({"!degrees": lambda text: math.radians(float(text))})) == math.pi


def test_what_only_the_loader_in_python_reads_is_read() -> None:
    document = read_yaml(Source("a.yaml", "b: |\n  \tc\na: {b:{c: 1}}\n"))
    assert document.data == {"b": "\tc\n", "a": {"b": {"c": 1}}}
    assert document.span("a", "b", "c").column == 8


def test_bounds_hold_for_it_too() -> None:
    for text in ("[" * 101 + "a:{b: 1}", "{a:{b: &b [*b]}}"):
        with pytest.raises(YamlError, match=r"it is nested more than 100 levels deep|too many values"):
            load_yaml(text)
