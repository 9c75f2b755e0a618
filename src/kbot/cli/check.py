"""`kbot check`: check a robot and report each problem at its source line."""

from __future__ import annotations

import os
import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import click

from kbot.checks import Config, all_rules, check_file, check_text, load_config
from kbot.checks.baseline import without_known
from kbot.checks.baseline import write_baseline as keep_baseline
from kbot.checks.file_kinds import kind_of
from kbot.checks.fixes import fixed, fixed_includes
from kbot.checks.folder_files import entry_points
from kbot.checks.formats import github, junit, relative, sarif
from kbot.checks.ranking import folded, is_note, ranked, summary
from kbot.checks.settings import with_selection
from kbot.cli.arguments import NO_FILE, collect_options, examples, package_path_option, split_arguments
from kbot.cli.output import fail, has_color, is_unusable, print_json
from kbot.cli.progress import busy
from kbot.model.load import resolve_robot_path
from kbot.text import DescriptionError, Diagnostic, Fix, Severity, read_source, rewrite
from kbot.text.edits import unified_diff
from kbot.text.files import unsaved
from kbot.text.folders import names_in
from kbot.text.notes import note
from kbot.text.render import count, render_text, to_json
from kbot.text.suggest import did_you_mean
from kbot.xacro import AmbiguousPackage, PackageNotFound, Packages

_FORMATS = ("text", "json", "sarif", "github", "junit")


@dataclass(frozen=True)
class _Job:
    """One file to check with one set of arguments."""

    path: str
    arguments: Mapping[str, str]
    config: Config
    packages: Packages
    properties: Mapping[str, str] = field(default_factory=dict)

    def check(self) -> tuple[Diagnostic, ...]:
        return check_file(self.path, self.arguments, self.packages, self.config, self.properties)

    def check_text(self, text: str) -> tuple[Diagnostic, ...]:
        return check_text(text, self.path, self.arguments, self.packages, self.config, self.properties)


@dataclass(frozen=True)
class _Choice:
    """The rules to report and to ignore, as typed: codes and prefixes, separated by commas."""

    select: tuple[str, ...]
    ignore: tuple[str, ...]


@dataclass(frozen=True)
class _FixOptions:
    fix: bool
    unsafe_fixes: bool
    diff: bool

    @property
    def is_requested(self) -> bool:
        return self.fix or self.unsafe_fixes or self.diff


@dataclass(frozen=True)
class _Baselines:
    """Files of known findings: the one whose findings are not reported, and the one to write."""

    baseline: str | None
    write_baseline: str | None


@dataclass(frozen=True)
class _Output:
    as_json: bool
    output_format: str | None
    statistics: bool
    verbose: bool

    @property
    def form(self) -> str:
        return "json" if self.as_json else self.output_format or "text"


@click.command(
    "check",
    epilog=examples(
        "kbot check robot.xacro",
        "kbot check robot.xacro wheel_radius:=0.04 --json",
        ("kbot check my_robot_description", "check a package or folder"),
        ("kbot check robot.xacro --fix", "apply the safe fixes"),
        ("kbot check robot.xacro --unsafe-fixes --diff", "preview all fixes"),
        ("kbot check . --output-format github", "annotate a pull request"),
        ("kbot rule I111", "explain a finding"),
    ),
)
@click.argument("words", nargs=-1, metavar="FILE|PACKAGE|FOLDER... [name:=value ...]")
@click.option("--json", "as_json", is_flag=True, help="Print JSON. Same as --output-format json.")
@click.option(
    "--output-format", type=click.Choice(_FORMATS), show_default="text", help="Format of the findings."
)
@click.option(
    "--select",
    metavar="CODES",
    multiple=True,
    help="Report only these rules. CODES are codes or prefixes of codes, separated by commas. Can be "
    "repeated.",
)
@click.option(
    "--ignore",
    metavar="CODES",
    multiple=True,
    help="Do not report these rules. CODES as for --select. Can be repeated.",
)
@click.option("--fix", is_flag=True, help="Apply the safe fixes to the files.")
@click.option("--unsafe-fixes", is_flag=True, help="Apply the safe and the unsafe fixes to the files.")
@click.option("--diff", is_flag=True, help="Print the fixes as a diff without changing the files.")
@click.option("--baseline", metavar="FILE", help="Do not report the findings that are listed in FILE.")
@click.option("--write-baseline", metavar="FILE", help="Write the current findings to FILE and exit.")
@click.option("--statistics", is_flag=True, help="Print the number of findings per rule.")
@click.option(
    "-v",
    "--verbose",
    is_flag=True,
    help="Print every finding in full, with all its places. "
    "By default, if there are errors, other findings are only summarized.",
)
@package_path_option
@collect_options("choice", _Choice)
@collect_options("fixing", _FixOptions)
@collect_options("baselines", _Baselines)
@collect_options("output", _Output)
def command(
    words: tuple[str, ...],
    choice: _Choice,
    fixing: _FixOptions,
    baselines: _Baselines,
    output: _Output,
    package_path: tuple[str, ...],
) -> int:
    """Check xacro, URDF and launch files, packages and folders.

    name:=value sets a xacro argument of each FILE or, if it has no argument of that name, a top-level
    property.

    Exit status: 0 no findings, or none left after the fixes; 1 findings; 2 a file cannot be read or is
    not well-formed.
    """
    files, values = split_arguments(words)
    if not files:
        fail(NO_FILE)
    jobs: list[_Job] = []
    found: list[Diagnostic] = []
    with busy("looking for files") as progress:
        for file in files:
            try:
                jobs += _jobs(file, values, choice, Packages(package_path), progress)
            except DescriptionError as error:
                found += error.diagnostics
    if values:
        jobs = _with_typed_names(jobs, values)
    changed, findings = _apply_fixes(jobs, fixing) if fixing.is_requested else ({}, {})
    with unsaved(changed if fixing.diff else {}), busy("checking") as progress:
        for number, job in enumerate(jobs, 1):
            progress(_checking(job, number, len(jobs)))
            known_findings = findings.get(id(job))
            found += job.check() if known_findings is None else known_findings
    found = _without_duplicates(found)
    if fixing.fix or fixing.unsafe_fixes:
        found = [_without_applied_fix(d, fixing.unsafe_fixes) for d in found]
    known = baselines.baseline or next((j.config.baseline for j in jobs if j.config.baseline), None)
    if baselines.write_baseline and not fixing.diff:
        _write_baseline(baselines.write_baseline, found)
        return 0
    if known:
        found = without_known(found, known)
    if fixing.diff:
        _print_remaining(found, fixing.unsafe_fixes)
    else:
        _print(found, output, [j.path for j in jobs])
    if any(is_unusable(d) for d in found):
        return 2
    return 1 if found else 0


def _checking(job: _Job, number: int, count: int) -> str:
    """What is shown while a job runs."""
    return f"checking {job.path}" + (f" ({number} of {count})" if count > 1 else "")


def _codes(words: Sequence[str]) -> tuple[str, ...]:
    return tuple(code.strip() for word in words for code in word.split(",") if code.strip())


def _jobs(
    file: str,
    arguments: Mapping[str, str],
    choice: _Choice,
    packages: Packages,
    progress: Callable[[str], None],
) -> list[_Job]:
    """The checks of one command-line word.

    A single file without typed values is checked once. All files of a folder, and a file with typed values,
    are checked with each set of arguments in the configuration. A typed value replaces the value in a set.
    """
    path = _resolve(resolve_robot_path(file), packages)
    is_folder = Path(path).is_dir()
    jobs = []
    for entry in entry_points(path, progress) if is_folder else [path]:
        folder = os.path.dirname(os.path.abspath(entry))  # noqa: PTH100, PTH120 - keeps symbolic links
        config = with_selection(load_config(folder), _codes(choice.select), _codes(choice.ignore))
        sets = (config.arguments if is_folder or arguments else ()) or ({},)
        distinct = list[Mapping[str, str]]()
        for arguments_of_set in ({**given, **arguments} for given in sets):
            if arguments_of_set not in distinct:  # typed values may make two sets the same
                distinct.append(arguments_of_set)
        jobs += [_Job(entry, given, config, packages) for given in distinct]
    return jobs


def _with_typed_names(jobs: Sequence[_Job], values: Mapping[str, str]) -> list[_Job]:
    """The jobs with the properties that typed names override. Prints a note for each of them.

    A name may exist only with some sets of arguments, because the arguments select includes. Jobs with other
    sets ignore the name.

    Raises:
        DescriptionError: a name is neither an argument nor a property of any description. If one of the files
            is a launch file, this is not checked: the rules of launch files check the names.
    """
    from kbot.xacro.assignments import Assignments, resolve_names  # rarely needed: start-up time

    resolved = dict[int, Assignments]()
    known = defaultdict[str, set[str]](set)
    """The names that a file has with any set of arguments, by the file's path."""
    has_launch_file = False
    """Whether a file is a launch file, which has arguments of its own."""
    for index, job in enumerate(jobs):
        kind = kind_of(job.path)
        has_launch_file |= kind is not None and kind.has_arguments
        if kind is None:
            names = resolve_names(job.path, values, job.packages, arguments=job.arguments)
            for text in names.notes:
                note(text)
            resolved[index] = names
            known[job.path] |= values.keys() - names.unknown.keys()
    unknown = [names.unknown for names in resolved.values()]
    if unknown and not has_launch_file:
        errors = [unknown[0][name] for name in values if all(name in of_file for of_file in unknown)]
        if errors:
            raise DescriptionError(errors)
    with_names = list(jobs)
    for index, names in resolved.items():
        elsewhere = names.unknown.keys() & known[jobs[index].path]
        arguments = {name: value for name, value in names.arguments.items() if name not in elsewhere}
        with_names[index] = replace(jobs[index], arguments=arguments, properties=names.properties)
    return with_names


def _resolve(word: str, packages: Packages) -> str:
    """The path that a word means: itself, or the folder of the package with this name."""
    if os.path.exists(word) or "/" in word or "\\" in word or "." in word:  # noqa: PTH110 - any text will do
        return word
    try:
        return packages.find(word)
    except AmbiguousPackage as error:
        raise DescriptionError(
            [Diagnostic("F001", Severity.ERROR, error.problem, None, error.hint)]
        ) from None
    except PackageNotFound as error:
        hint = did_you_mean(word, names_in("")) or error.hint
        message = f"there is no file, folder or package '{word}'"
        raise DescriptionError([Diagnostic("F001", Severity.ERROR, message, None, hint)]) from None


def _apply_fixes(
    jobs: Sequence[_Job], fixing: _FixOptions
) -> tuple[Mapping[str, str], Mapping[int, Sequence[Diagnostic]]]:
    """Apply the fixes to the jobs' files and their includes, or print them as a diff.

    Returns the new texts by path. If there are none, it also returns the findings by the `id` of their job,
    so that no file is checked twice: a check of a large file takes seconds.
    """
    changed: dict[str, tuple[str, str, str]] = {}
    """By real path, because a file may have several names: its first name, the text before and after."""
    after: dict[str, str] = {}
    findings: dict[int, Sequence[Diagnostic]] = {}
    fixes: list[Fix] = []
    outside: dict[str, None] = {}
    files = {j.path: j for j in jobs}.values()
    with busy("checking") as progress:
        for number, job in enumerate(files, 1):
            progress(_checking(job, number, len(files)))
            with unsaved(after):
                try:
                    source = read_source(job.path)
                except DescriptionError:
                    continue
                text, own, found = fixed(source.text, job.path, job.check_text, fixing.unsafe_fixes)
                findings[id(job)] = found
                with unsaved({job.path: text}):
                    includes = fixed_includes(job.path, found, job.check, fixing.unsafe_fixes)
            for path, (old, new) in {job.path: (source.text, text), **includes.texts}.items():
                if old != new:
                    real = os.path.realpath(path)
                    name, old = changed.get(real, (path, old))[:2]
                    changed[real], after[real] = (name, old, new), new
            fixes += [*own, *includes.fixes]
            outside.update(dict.fromkeys(includes.outside))
    if fixing.diff:
        for name, old, new in changed.values():
            click.echo(unified_diff(old, new, relative(name)), nl=False)
    else:
        rewrite({name: (old, new) for name, old, new in changed.values()})
    for fix in () if fixing.diff else fixes:
        click.echo(f"{relative(fix.edits[0].span.file)}: {fix.title}", err=True)
    for path in outside:
        click.echo(f"{path}: not fixed, because it is outside the working directory", err=True)
    return after, ({} if after else findings)


def _without_applied_fix(found: Diagnostic, unsafe: bool) -> Diagnostic:
    """A finding that remains after the fixes, without its own fix if that was among those applied."""
    return replace(found, fix=None) if found.fix and (found.fix.safe or unsafe) else found


def _print_remaining(found: Sequence[Diagnostic], unsafe: bool) -> None:
    """Print on stderr how many findings have no fix: an empty diff alone looks like no findings."""
    if not found:
        return
    more = sum(bool(d.fix and not d.fix.safe) for d in found)
    by_others = f"; {more} can be fixed by --unsafe-fixes" if more and not unsafe else ""
    fixes = "fix" if unsafe else "safe fix"
    click.echo(f"{count(found)} without a {fixes}{by_others}. Run without --diff to list them", err=True)


def _write_baseline(path: str, found: Sequence[Diagnostic]) -> None:
    keep_baseline(path, found)
    click.echo(f"{path}: wrote a baseline of {len(found)} findings", err=True)


def _without_duplicates(found: Sequence[Diagnostic]) -> list[Diagnostic]:
    """The findings, each only once even if several entry points or sets of arguments have it."""
    seen: dict[tuple[str, str, str, int], Diagnostic] = {}
    for diagnostic in found:
        span = diagnostic.origin.span if diagnostic.origin else None
        file = os.path.abspath(span.file) if span else ""  # noqa: PTH100 - keeps symbolic links
        key = (diagnostic.code, diagnostic.message, file, span.start if span else 0)
        first = seen.setdefault(key, diagnostic)
        if span and first.origin and len(span.file) < len(first.origin.span.file):
            seen[key] = diagnostic  # the name that the user typed; a package search finds longer ones
    return list(seen.values())


def _print(found: Sequence[Diagnostic], output: _Output, files: Sequence[str]) -> None:
    form, statistics = output.form, output.statistics
    if form == "json":
        summary = {"statistics": dict(Counter(d.code for d in found))} if statistics else {}
        print_json({"findings": [to_json(d) for d in found], **summary})
    elif form == "sarif":
        from importlib.metadata import version  # slow to import

        # indenting a large log takes ten times as long, and only programs read it
        print_json(sarif(found, version("kbot")), indent=None)
    elif form == "github":
        click.echo(github(found), nl=False)
    elif form == "junit":
        click.echo(junit(found, files), nl=False)
    else:
        _print_text(found, output.verbose)
        if found:
            click.echo(_summary(found))
        elif sys.stderr.isatty():  # confirm it to a person; a pipe gets no output
            click.echo("no findings", err=True)
    if statistics and form == "text":
        for code, number in Counter(d.code for d in found).most_common():
            rule = all_rules().get(code)
            click.echo(f"{number:6}  {code}  {rule.name if rule else ''}".rstrip())


def _print_text(found: Sequence[Diagnostic], verbose: bool) -> None:
    """Print the findings, errors first. While there are errors, the others are only summarized: they may
    change with the errors. Notes are one line."""
    in_order = ranked(found)
    notes = [] if verbose else [d for d in in_order if is_note(d)]
    errors = [d for d in in_order if d.is_error]
    others = [d for d in in_order if not d.is_error]
    is_short = bool(errors and others) and not verbose
    shown = errors if is_short else [d for d in in_order if d not in notes]
    click.echo(render_text(shown, color=has_color(sys.stdout), every_place=verbose), nl=False)
    if is_short:
        click.echo(f"\nAfter the {'errors' if len(errors) > 1 else 'error'} (-v shows all findings):")
        for line in summary(others):
            click.echo(f"  {line}")
        click.echo()
    elif notes:
        click.echo(folded(notes) + "\n")


def _summary(found: Sequence[Diagnostic]) -> str:
    safe = sum(bool(d.fix and d.fix.safe) for d in found)
    unsafe = sum(bool(d.fix and not d.fix.safe) for d in found)
    parts = [f"{safe} can be fixed by --fix"] if safe else []
    if unsafe:
        parts.append(f"{unsafe} {'more' if safe else 'can be fixed'} by --unsafe-fixes")
    return count(found) + (f"; {', '.join(parts)}" if parts else "")
