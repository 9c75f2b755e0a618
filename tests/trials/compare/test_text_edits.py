"""Edits between texts: applying all of them gives the other text, and each is as small as it makes sense."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.trials.compare.text_edits import applied, edit_groups, text_edits

_LINES = st.lists(
    st.sampled_from(
        [
            "<link>\n",
            "</link>\n",
            '<origin xyz="0 0 1"/>\n',
            '<origin xyz="0 0.5 1"/>\n',
            "<mu1>${a}</mu1>\n",
            "<mu1>${2*b}</mu1>\n",
            "\n",
            "<!-- a -->\n",
            "a: 1\r\n",
            "é: 2",
        ]
    ),
    max_size=12,
).map("".join)


@given(_LINES | st.text(max_size=60), _LINES | st.text(max_size=60), st.data())
def test_all_edits_give_the_other_text_and_any_of_them_apply(before: str, after: str, data: st.DataObject):
    edits = text_edits(before, after)
    assert applied(before, after, edits) == after
    assert applied(before, after, ()) == before
    assert not edits or before != after
    assert all(one.end <= other.start for one, other in pairwise(sorted(edits, key=lambda e: e.start)))
    chosen = data.draw(st.sets(st.sampled_from(edits))) if edits else ()
    untouched = [e for e in edits if e not in chosen]
    rest = applied(before, after, chosen)
    assert len(rest) == len(after) + sum((e.end - e.start) - (e.to_end - e.to_start) for e in untouched)


@given(_LINES | st.text(max_size=60), _LINES | st.text(max_size=60))
def test_groups_have_each_edit_once(before: str, after: str):
    groups = edit_groups(before, after)
    assert sorted(map(repr, (edit for group in groups for edit in group))) == sorted(
        map(repr, text_edits(before, after))
    )


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ('v="${a}"\n', 'v="${2*(b)}"\n', [["2*(", ")"], ["b"]]),
        ('v="${a}" w="1"\n', "v='${a}' w=\"2\"\n", [["'", "'"], ["2"]]),
        ('<s type="ray" name="l">\n', '<s name="l" type="ray">\n', [['name="l" ', ""]]),
        ('v="(1)"\nw="2"\n', 'v="1"\nw="3"\n', [["", ""], ["3"]]),
    ],
)
def test_edits_that_belong_together(before: str, after: str, expected: list[list[str]]):
    groups = edit_groups(before, after)
    assert [[after[e.to_start : e.to_end] for e in group] for group in groups] == expected


def changes(before: str, after: str) -> list[tuple[str, str]]:
    return [(before[e.start : e.end], after[e.to_start : e.to_end]) for e in text_edits(before, after)]


J1, J2, J3 = ("<j>\na\n</j>\n".replace("a", name) for name in "xyz")


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        # two attributes of one line
        ('<o xyz="0 0 1" rpy="0 0 0"/>\n', '<o xyz="0 2 1" rpy="0 3 0"/>\n', [("0", "2"), ("0", "3")]),
        # a new name and a factor in one expression
        ("${width + gap}\n", "${1.1*(span + gap)}\n", [("", "1.1*("), ("width", "span"), ("", ")")]),
        # an attribute behind the one that changed
        ('<w y="0.2"/>\n', '<w y="0.3" z="0"/>\n', [("0.2", "0.3"), ("", ' z="0"')]),
        # a line each
        ("a: 1\nb: 2\nc: 3\n", "a: 9\nb: 8\nc: 3\n", [("1", "9"), ("2", "8")]),
        # elements and comments that were added together are separate
        ("<a/>\n", "<a/>\n<!-- b -->\n<c>\n<d/>\n</c>\n", [("", "<!-- b -->\n"), ("", "<c>\n<d/>\n</c>\n")]),
        # an element that was added is complete, although the lines around it are equal
        (f"{J1}{J3}", f"{J1}{J2}{J3}", [("", J2)]),
        (f"{J1}{J2}{J3}", f"{J1}{J3}", [(J2, "")]),
        # a line was split in two
        ('<o x="1" y="2"/>\n', '<o x="1"\n   y="3"/>\n', [(" ", "\n   "), ("2", "3")]),
        # nothing in common
        ("<a/>\n", "some: text, of another kind\n", [("<a/>\n", "some: text, of another kind\n")]),
    ],
)  # fmt: skip
def test_the_edits_of(before: str, after: str, expected: list[tuple[str, str]]):
    assert changes(before, after) == expected


def test_lines_match_although_a_name_is_new_in_each():
    block = '<j name="${{{0}}}a">\n<m v="1"/>\n</j>\n<j name="${{{0}}}b">\n<m v="1"/>\n<n/>\n</j>\n'
    before, after = block.format("space"), block.format("place")
    assert changes(before, after.replace('"1"', '"2"', 1)) == [
        ("space", "place"),
        ("1", "2"),
        ("space", "place"),
    ]
