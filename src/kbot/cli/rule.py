"""`kbot rule`: what a code means, why it matters, how to mend it."""

from __future__ import annotations

import click

from kbot.checks import Rule, all_rules, find_rule
from kbot.cli.arguments import examples
from kbot.cli.output import fail, print_json


@click.command("rule", epilog=examples("kbot rule I111", "kbot rule tensor-not-turned", "kbot rule --all"))
@click.argument("words", nargs=-1, metavar="CODE...")
@click.option("--all", "every", is_flag=True, help="One line for each rule.")
@click.option("--json", "as_json", is_flag=True, help="As JSON.")
def command(words: tuple[str, ...], every: bool, as_json: bool) -> int:
    """Print the page of a rule, by its code or its name."""
    if not words and not every:
        fail("no CODE was given; --all lists every rule")
    rules = [find_rule(word) for word in words] or sorted(all_rules().values(), key=lambda r: r.code)
    if as_json:
        print_json({"rules": [_json(r) for r in rules]})
    elif every and not words:
        for rule in rules:
            click.echo(f"{rule.code}  {rule.severity:7}  {rule.name:28}  {rule.summary}")
    else:
        click.echo("\n\n".join(_page(r) for r in rules))
    return 0


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
