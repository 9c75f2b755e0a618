"""`kbot rule`: explain a code and how to fix its findings."""

from __future__ import annotations

import re
from collections.abc import Sequence

import click

from kbot.checks import Rule, all_rules, find_rule
from kbot.cli.arguments import examples, json_option
from kbot.cli.output import fail, print_json


@click.command("rule", epilog=examples("kbot rule I111", "kbot rule tensor-not-turned", "kbot rule --all"))
@click.argument("words", nargs=-1, metavar="CODE...")
@click.option("--all", "every", is_flag=True, help="List all rules, one per line.")
@json_option
@click.option("--markdown", is_flag=True, help="Print Markdown.")
def command(words: tuple[str, ...], every: bool, as_json: bool, markdown: bool) -> int:
    """Explain rules of kbot check, by code or name: what they mean, why they matter, how to fix a finding."""
    if not words and not every:
        fail("no CODE was given; --all lists every rule")
    rules = [find_rule(word) for word in words] or sorted(all_rules().values(), key=lambda r: r.code)
    if as_json:
        print_json({"rules": [_json(r) for r in rules]})
    elif markdown:
        click.echo(rules_as_markdown(rules), nl=False)
    elif every and not words:
        for rule in rules:
            click.echo(f"{rule.code}  {rule.severity:7}  {rule.name:28}  {rule.summary}")
    else:
        click.echo("\n\n".join(_page(r) for r in rules))
    return 0


_HEADING = re.compile(r"^(What|Why|Example|Fix|Autofix):", re.MULTILINE)
_FAMILIES = {
    "F": "Files",
    "P": "XML",
    "X": "Expansion",
    "S": "Source",
    "U": "Structure",
    "J": "Joints",
    "I": "Inertia",
    "G": "Geometry and meshes",
    "D": "Differential drive and ground contact",
    "C": "Sensors and frames",
    "L": "Launch files",
    "W": "Worlds and simulation",
    "K": "The checker itself",
}


def rules_as_markdown(rules: Sequence[Rule]) -> str:
    """The pages of rules as one Markdown document, by family: a table, then each page."""
    parts = [
        "# What `kbot check` finds",
        "",
        "Written by `kbot rule --all --markdown`; `kbot rule CODE` prints a page.",
        "",
    ]
    for letter, family in _FAMILIES.items():
        own = [r for r in rules if r.code.startswith(letter)]
        if not own:
            continue
        parts += [
            f"## {family}",
            "",
            "| code | name | severity | fix | what |",
            "| --- | --- | --- | --- | --- |",
        ]
        for rule in own:
            what = rule.summary.replace("|", "\\|")
            parts.append(
                f"| [{rule.code}](#{rule.code.lower()}-{rule.name}) | {rule.name} | {rule.severity} | "
                f"{rule.fix} | {what} |"
            )
        parts.append("")
        for rule in own:
            parts += [
                f"### {rule.code} {rule.name}",
                "",
                f"*{rule.severity}, since {rule.since}*",
                "",
                _HEADING.sub(r"**\1:**", rule.page),
                "",
            ]
    return "\n".join(parts)


def _page(rule: Rule) -> str:
    return f"{rule.code} {rule.name} ({rule.severity}, since {rule.since})\n\n{rule.page}"


def _json(rule: Rule) -> dict[str, str]:
    return {
        "code": rule.code,
        "name": rule.name,
        "severity": str(rule.severity),
        "since": rule.since,
        "fix": rule.fix,
        "page": rule.page,
    }
