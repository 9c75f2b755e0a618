"""The page of a rule, for the page's list of findings."""

from __future__ import annotations

from kbot.workbench.protocol import RulePage, RuleSection


def rule_page(code: str) -> RulePage:
    """Return the page of a rule, with one section for each of its paragraphs, such as Why and Fix.

    Raises:
        KbotError: there is no rule with this code.
    """
    from kbot.checks import find_rule  # imported lazily: it loads all rules

    rule = find_rule(code)
    sections = (paragraph.partition(": ") for paragraph in rule.page.split("\n\n"))
    return RulePage(rule.code, rule.name, tuple(RuleSection(title, text) for title, _, text in sections))
