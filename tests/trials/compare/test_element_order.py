"""Elements in the order of another text, with nothing else changed."""

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.text import Source, parse_xml
from kbot.trials.compare.element_order import in_order_of

ROOT = '<robot xmlns:xacro="x">'
PARTS = (
    '<link name="a"><visual/><!-- é --><collision/></link>',
    '<link name="b"/>',
    '<joint name="a"><origin xyz="0 0 0"/><axis/></joint>',
    '<gazebo reference="a"><mu1>1</mu1></gazebo>',
    '<xacro:wheel name="left"/>',
)


@given(st.permutations(PARTS), st.permutations(PARTS))
def test_all_named_elements_are_in_the_other_order(one: list[str], other: list[str]):
    texts = [f"{ROOT}\n  {chr(10).join(parts)}\n</robot>\n" for parts in (one, other)]
    assert in_order_of(*texts) == texts[1]


@given(st.lists(st.sampled_from(PARTS), max_size=7), st.lists(st.sampled_from(PARTS), max_size=7))
def test_no_element_is_lost(one: list[str], other: list[str]):
    text, order = (f"{ROOT}{''.join(parts)}</robot>" for parts in (one, other))
    found = in_order_of(text, order)
    assert Counter(found) == Counter(text)
    tags = [[e.tag for e in parse_xml(Source("", t)).descendants()] for t in (found, text)]
    assert Counter(tags[0]) == Counter(tags[1])
    assert in_order_of(found, order) == found


@pytest.mark.parametrize(
    ("text", "other", "expected"),
    [
        # parts of an element that was moved and changed
        (
            '<r><a name="1"><x v="1"/><y/></a><b/></r>',
            '<r><b/><a name="1"><y/><x v="2"/></a></r>',
            '<r><b/><a name="1"><y/><x v="1"/></a></r>',
        ),
        # a name that is computed from a property with a new name
        ('<r><a name="${p}1"/><b/></r>', '<r><b/><a name="${q}1"/></r>', '<r><b/><a name="${p}1"/></r>'),
        # two elements of one name keep their places
        ("<r><a/><a/><b/></r>", "<r><b/><a/><a/></r>", "<r><a/><a/><b/></r>"),
        ("a: 1\n", "b: 1\n", "a: 1\n"),
        ("<r><a/><b/></r>", "<r><b/><a/>", "<r><a/><b/></r>"),
    ],
)
def test_the_order_of(text: str, other: str, expected: str):
    assert in_order_of(text, other) == expected
