"""Reads scenario files: YAML with one scenario per document, Python, and folders of both."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kbot.text import DescriptionError, Diagnostic, KbotError, Origin, Source, read_source
from kbot.text.diagnostic_collector import DiagnosticCollector
from kbot.text.folders import files_below
from kbot.text.yaml import Dialect, YamlError, read_yaml
from kbot.trials.formats import VALUE_WRONG, Place, Record
from kbot.trials.python_file import read_python_scenarios
from kbot.trials.scenario import Scenario
from kbot.trials.schema import scenario_format

YAML_SUFFIXES = (".yaml", ".yml")
SUFFIXES = (*YAML_SUFFIXES, ".py")
"""Endings of files that are read as scenarios if they are named."""
FOUND = tuple(f".scenario{suffix}" for suffix in SUFFIXES)
"""Endings of files that are found in folders."""
NOT_YAML = "T101"
_DOCUMENT = re.compile(r"^---(?=\s|$)", re.MULTILINE)
_CONTENT = re.compile(r"^(?!---\s*(?:#.*)?$)[^\S\n]*[^\s#%]", re.MULTILINE)
"""A line that is more than a comment, a directive, or the mark of a document."""
# YAML 1.1 reads 1e-3 as a text: it wants 1.0e-3
_FLOAT = re.compile(r"(?<![\d.+-])[-+]?(?:\d+(?:\.\d*)?|\.\d+)[eE][-+]?\d+$")
_NUMBERS = Dialect(patterns={"tag:yaml.org,2002:float": _FLOAT})


@dataclass(frozen=True, slots=True)
class FoundScenario:
    """A scenario of a file. One of a Python file has no steps and no expectations: see `python_scenarios`."""

    scenario: Scenario
    file: str
    index: int = 0

    @property
    def python_file(self) -> str:
        return self.file if self.file.endswith(".py") else ""

    def whole(self) -> Scenario:
        """The scenario with its steps and expectations. Raises KbotError, as `read_python_scenarios` does."""
        return read_python_scenarios(self.file)[self.index] if self.python_file else self.scenario


def find_scenario_files(path: str) -> list[str]:
    """The scenario files of a path: itself, or those in a folder, sorted.

    Raises:
        KbotError: the folder has none, or too many files.
    """
    if not Path(path).is_dir():
        return [path]
    found = sorted(files_below(path, lambda name: name.endswith(FOUND)))
    if not found:
        endings = ", ".join(f"*{ending}" for ending in FOUND)
        raise KbotError(f"{path} contains no scenario file: their names end in {endings}")
    return found


def python_scenarios(path: str) -> list[FoundScenario]:
    """The scenarios of a Python file, without what cannot be sent to another process.

    Raises KbotError, as `read_python_scenarios` does.
    """
    return [
        FoundScenario(replace(scenario, steps=(), expect=()), path, index)
        for index, scenario in enumerate(read_python_scenarios(path))
    ]


def yaml_scenarios(path: str) -> tuple[list[Scenario], list[str], list[Diagnostic]]:
    """The scenarios of a YAML file, the names of those that have errors, and all errors."""
    default = _name_of(path)
    try:
        source = read_source(path)
    except DescriptionError as error:
        return [], [default], list(error.diagnostics)
    errors = DiagnosticCollector()
    found: list[Scenario] = []
    unusable: list[str] = []
    documents = _documents(source)
    for number, document in enumerate(documents, 1):
        name = default if len(documents) == 1 else f"{default}-{number}"
        scenario = _read(document, name, errors)
        if isinstance(scenario, Scenario):
            found.append(scenario)
        else:
            unusable.append(scenario)
    if not documents:
        errors.error(NOT_YAML, "the file contains no scenario", Origin(source.whole()))
        unusable.append(default)
    return found, unusable, errors.diagnostics


def read_scenarios(path: str) -> list[Scenario]:
    """The scenarios of a file. Raises DescriptionError with all errors. Raises KbotError for Python files."""
    if path.endswith(".py"):
        return read_python_scenarios(path)
    found, _, errors = yaml_scenarios(path)
    if errors:
        raise DescriptionError(errors)
    return found


def _read(source: Source, name: str, errors: DiagnosticCollector) -> Scenario | str:
    """The scenario of a document, or its name after an error."""
    try:
        document = read_yaml(source, _NUMBERS)
    except YamlError as error:
        errors.error(NOT_YAML, error.problem, Origin(error.span), _yaml_hint(error.problem))
        return name
    at = Place(document, DiagnosticCollector())
    data: Any = document.data
    if isinstance(data, dict) and isinstance(data.get("name"), str) and data["name"]:
        name = data["name"]
    for span in document.repeated_keys():
        at.errors.error(VALUE_WRONG, f"the key '{span.text}' is given twice", Origin(span))
    found = _format(name).read(data, at)
    errors.diagnostics += sorted(at.errors.diagnostics, key=_position)
    return name if at.errors.diagnostics else found


def _yaml_hint(problem: str) -> str:
    """What to do about an error of YAML, whose own words name the parts of a parser."""
    if r"'\t'" in problem:
        return "indent with spaces: YAML does not accept tabs"
    if "flow" in problem:
        return "separate entries by commas, and close each { with } and each [ with ]"
    if "block" in problem or "mapping values are not allowed" in problem:
        return "check the indentation: keys of one mapping, and items of one list, begin in the same column"
    return ""


def _position(error: Diagnostic) -> int:
    return error.origin.span.start if error.origin is not None else 0


def _format(name: str) -> Record:
    """The format of a scenario whose name is by default `name`."""
    base = scenario_format()

    def make(**values: Any) -> Scenario:  # noqa: ANN401 - the fields of Scenario
        return Scenario(**{**values, "name": values.get("name") or name})

    return replace(base, kind=make)


def _documents(source: Source) -> list[Source]:
    """The documents of a text, each at its own lines."""
    marks = [match.start() for match in _DOCUMENT.finditer(source.text)]
    parts = zip([0, *marks], [*marks, len(source.text)], strict=True)
    return [
        Source(source.path, "\n" * source.text.count("\n", 0, start) + source.text[start:end])
        for start, end in parts
        if _CONTENT.search(source.text, start, end)
    ]


def _name_of(path: str) -> str:
    """The name of a scenario whose file has this path: without its endings."""
    name = Path(path).name
    ending = next((each for each in (*FOUND, *SUFFIXES) if name.endswith(each)), "")
    return name.removesuffix(ending) or name
