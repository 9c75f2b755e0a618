"""Words of `rosbag` and `ros2 bag` that `kbot bag` takes, or says where it is done."""

from __future__ import annotations

import click

ELSEWHERE = {
    "record": "a run is recorded by kbot sim ROBOT --record FILE",
    "reindex": "kbot bag convert FILE NEW writes what broke off anew",
    "check": "kbot bag info FILE says whether it is whole",
    "filter": "kbot bag cut FILE NEW --topic NAME --start S --end S leaves the rest out",
    "compress": "kbot bag convert FILE NEW.mcap compresses",
}
"""Commands of theirs, and what is there in their place."""

_LISTS = {
    "--topics": "--topic",
    "--exclude-topics": "--exclude-topic",
    "--remap": "--remap",
    "-m": "--remap",
}
"""Options that are followed by several words, and the one that takes each."""


class Bag(click.Group):
    """Says of a command that is not there where it is done."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        word = args[0]
        if word in ELSEWHERE:
            raise click.UsageError(f"no such command: {word}; {ELSEWHERE[word]}", ctx)
        return super().resolve_command(ctx, args)


class Play(click.Command):
    """Takes `--topics A B …` as rosbag and ros2 bag do, up to the next option, `A:=B` as rosbag does, and
    `--clock` with a rate."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        words: list[str] = []
        one = before = ""
        for word, after in zip(args, [*args[1:], "-"], strict=True):
            if word.startswith("-"):
                one = _LISTS.get(word, "")
                if one and after.startswith("-"):
                    raise click.UsageError(f"{word} is followed by names of topics", ctx)
                words += [] if one else [word]
            elif ":=" in word:
                words += ["--remap", word]
            elif before != "--clock" or not _is_number(word):
                words += [one, word] if one else [word]
            before = word
        return super().parse_args(ctx, words)


def read_remaps(words: tuple[str, ...]) -> dict[str, str]:
    """`/odom:=/odometry`, several of them. Raises UsageError: one is not written so."""
    for word in words:
        if not all(word.partition(":=")):
            raise click.UsageError(f"--remap {word}: a remap is written OLD:=NEW")
    return dict(word.split(":=", 1) for word in words)


def _is_number(word: str) -> bool:
    return word.replace(".", "", 1).isdecimal()
