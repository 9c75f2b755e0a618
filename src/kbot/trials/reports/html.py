"""Writes the results of trials as one HTML file, which needs no network and no JavaScript.

Names and texts come from files of strangers: all text passes `escaped`. The policy in the page allows no
script, no address, and no style but its own.
"""

from __future__ import annotations

import base64
import hashlib
import math
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from importlib.metadata import version
from importlib.resources import files

import numpy as np

from kbot.render.path_svg import Area, Circle, Mark, PathPicture, path_svg
from kbot.text import Diagnostic, KbotError, xml_text
from kbot.text.diagnostic import Severity
from kbot.text.files import write_text
from kbot.text.render import place, render_text
from kbot.trials.measures import find_measure
from kbot.trials.reports.charts import charts
from kbot.trials.reports.table import replay_command
from kbot.trials.results import MeasureResult, TrialResult, with_unit
from kbot.trials.surroundings import Outlined, Surroundings
from kbot.trials.trace import Event, Trace

MOST_TRIALS = 5000
"""Rows of the table of trials."""
MOST_FAILED, MOST_PASSED = 100, 200
"""Trials that are shown in detail."""
MOST_CHARACTERS = 4000
"""Characters of one text. A stranger's name may be as long as its file, and is in many places."""
MOST_FILM_BYTES = 20_000_000
"""Size of all films of a report. A film of 5 s takes about 300 kB."""
MOST_PLOT_BYTES = 10_000_000
"""Size of all plots of a report. Those of a trial take about 50 kB."""
MOST_CHARTS, MOST_EVENTS, MOST_FINDINGS = 8, 40, 20
"""Plots, events and findings of one trial."""

_DESCRIPTIONS = {
    "distance_to_target": "distance to the target at the end",
    "heading_to_target": "difference to the heading at the target at the end",
    "arrival_time": "time from which the robot stays at the target",
    "distance_from_path": "smallest distance of the path from this place",
    "steps_begun": "number of steps of the scenario that began",
}
"""Texts for measures that are not in the registry: those of expectations, and of steps that never began."""
_CARETS = re.compile(r"^(\s*\|\s*)(\^+)$")
_INVISIBLE = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]"
)
"""Characters that HTML does not allow, that UTF-8 cannot encode, or that reverse the order of a text."""
_BAR_WIDTH, _BAR_HEIGHT = 210, 18
MARK = '<meta name="generator" content="KBot">'
"""A line of every report, by which KBot knows that it may overwrite the file."""


def write_html(path: str, results: Sequence[TrialResult], title: str = "KBot trials") -> None:
    """Write a report.

    Results with a trace are shown with their path, and those with a film with the film.

    Raises:
        KbotError: the file cannot be written.
    """
    write_text(path, html_report(results, title))


def html_report(results: Sequence[TrialResult], title: str = "KBot trials") -> str:
    """The HTML of a report."""
    failed = [each for each in enumerate(results) if not each[1].passed]
    passed = [each for each in enumerate(results) if each[1].passed]
    room = Room()
    body = [
        "<header>",
        f"<h1>{escaped(title)}</h1>",
        f'<p class="verdict">{_verdict(len(failed), len(passed))}</p>',
        _share(len(passed), len(results)) if results else "",
        "</header>",
        "<main>",
        _table(results),
        *(_failed_trial(index, result, room) for index, result in failed[:MOST_FAILED]),
        *(_passed_trial(index, result, room) for index, result in passed[:MOST_PASSED]),
        "</main>",
        "<footer>",
        *(f"<p>{line}</p>" for line in _omitted(len(results), len(failed), len(passed), room)),
        f"<p>Written by KBot {escaped(version('kbot'))}.</p>",
        "</footer>",
    ]
    return page(title, "\n".join(filter(None, body)))


def page(title: str, body: str) -> str:
    """A page with the style of reports. `body` is HTML. The page's policy allows no script and no network."""
    style = files("kbot.trials.reports").joinpath("report.css").read_text("utf-8")
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; style-src 'sha256-{digest}'; img-src data:; base-uri 'none'; form-action 'none'"
    )
    body, title = (_INVISIBLE.sub("\N{REPLACEMENT CHARACTER}", text) for text in (body, title))
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f"{MARK}\n"
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="referrer" content="no-referrer">\n'
        f"<title>{escaped(title)}</title>\n<style>{style}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def _film_figure(film: bytes, caption: str) -> str:
    """A film that readers can close. With reduced motion, and in print, its last picture replaces it."""
    from kbot.render.film import still  # imported lazily: reports without films need no OpenGL

    images = (
        f'<img class="{kind}" src="{_data_uri(media_type, data)}" alt="{escaped(caption)}">'
        for kind, media_type, data in (
            ("moving", _media_type(film), film),
            ("still", "image/webp", still(film)),
        )
    )
    return (
        f'<details class="film" open><summary><h3>Film</h3></summary><figure>{"".join(images)}'
        f"<figcaption>{escaped(caption)}</figcaption></figure></details>"
    )


class Room:
    """Counts the bytes of films and plots, so that a report stays small enough to be opened."""

    def __init__(self) -> None:
        self._films, self._plots = MOST_FILM_BYTES, MOST_PLOT_BYTES
        self.films_omitted = self.plots_omitted = 0

    def film(self, film: bytes) -> bool:
        """Whether there is room for a film."""
        has_room = len(film) <= self._films
        self._films -= len(film) if has_room else 0
        self.films_omitted += not has_room
        return has_room

    def plots(self, plots: str) -> bool:
        """Whether there is room for the plots of a trial."""
        has_room = len(plots) <= self._plots
        self._plots -= len(plots) if has_room else 0
        self.plots_omitted += not has_room
        return has_room


def _verdict(failed: int, passed: int) -> str:
    total = failed + passed
    if not total:
        return "No trial was run."
    if not failed:
        return f"All {total} trials passed." if total > 1 else "The trial passed."
    return f"{failed} of {total} trials failed." if total > 1 else "The trial failed."


def _share(passed: int, total: int) -> str:
    """A bar of failed and passed trials."""
    width = 100.0 * (total - passed) / total
    return (
        '<svg class="share" viewBox="0 0 100 8" preserveAspectRatio="none" aria-hidden="true">'
        '<rect width="100" height="8" fill="var(--good)"/>'
        f'<rect width="{width:.2f}" height="8" fill="var(--error)"/></svg>'
    )


def _table(results: Sequence[TrialResult]) -> str:
    if len(results) < 2:
        return ""
    shown = {index for index, _ in _in_detail(results)}
    rows = []
    for index, result in enumerate(results[:MOST_TRIALS]):
        name = escaped(result.title)
        link = f'<a href="#trial-{index}">{name}</a>' if index in shown else name
        first, *others = _reasons(result) or [""]
        reason = f"{first}, and {len(others)} more" if others else first
        rows.append(
            f'<tr class="{_status(result)}"><td>{_badge(result)}</td><th scope="row">{link}</th>'
            f"<td>{escaped(result.robot)}</td><td>{escaped(reason)}</td></tr>"
        )
    return (
        '<section class="panel"><table><thead><tr><th scope="col">Result</th><th scope="col">Trial</th>'
        f'<th scope="col">Robot</th><th scope="col">Reason</th></tr></thead><tbody>{"".join(rows)}</tbody>'
        "</table></section>"
    )


def _in_detail(results: Sequence[TrialResult]) -> Iterator[tuple[int, TrialResult]]:
    left = {True: MOST_PASSED, False: MOST_FAILED}
    for index, result in enumerate(results):
        if left[result.passed] > 0:
            left[result.passed] -= 1
            yield index, result


def _omitted(total: int, failed: int, passed: int, room: Room) -> Iterator[str]:
    """What the report does not show."""
    if total > MOST_TRIALS:
        yield f"The table shows the first {MOST_TRIALS} of {total} trials."
    for count, most, what in ((failed, MOST_FAILED, "failed"), (passed, MOST_PASSED, "passed")):
        if count > most:
            yield f"The first {most} of {count} trials that {what} are shown in detail."
    for count, what in ((room.films_omitted, "films"), (room.plots_omitted, "trials' plots")):
        if count:
            yield f"{count} {what} are not shown, to keep the report small."


def _failed_trial(index: int, result: TrialResult, room: Room) -> str:
    reasons = "".join(f"<li>{escaped(reason)}</li>" for reason in _reasons(result))
    return (
        f'<article class="failed" id="trial-{index}" aria-labelledby="name-{index}"><header>{_badge(result)}'
        f'<h2 id="name-{index}">{escaped(result.title)}</h2>{_subtitle(result)}</header>'
        f'<ul class="reasons">{reasons}</ul>{_content(result, room)}</article>'
    )


def _passed_trial(index: int, result: TrialResult, room: Room) -> str:
    return (
        f'<article class="passed" id="trial-{index}" aria-labelledby="name-{index}"><details><summary>'
        f'{_badge(result)}<h2 id="name-{index}">{escaped(result.title)}</h2>{_subtitle(result)}</summary>'
        f'<div class="content">{_content(result, room)}</div></details></article>'
    )


def _content(result: TrialResult, room: Room) -> str:
    """The film, path, measures, plots, findings and events of a trial."""
    trace = result.trace
    parts = [film_and_path(result, room), _measures(result.measures)]
    shown = [measure for measure in result.measures if result.passed or not measure.passed]
    plots = [
        f"<figure><h3>{escaped(chart.title)}</h3>{chart.svg}</figure>"
        for chart in charts(result, shown[:MOST_CHARTS])
    ]
    drawn = f'<div class="media">{"".join(plots)}</div>' if plots else ""
    if drawn and room.plots(drawn):
        parts.append(drawn)
    parts.append(_source_lines(result))
    parts.append(_findings(result.findings))
    if trace is not None:
        parts.append(events(trace))
    parts.append(_about(result))
    return "".join(parts)


def film_and_path(result: TrialResult, room: Room) -> str:
    """The film of a trial, or why there is none, and the path on a map."""
    trace, media, problem = result.trace, [], ""
    if result.film and room.film(result.film):
        media.append(f"<div>{_film_figure(result.film, _film_caption(result))}</div>")
    if trace is not None and len(trace) > 0 and result.surroundings is not None:
        media.append(f"<div><h3>Path</h3>{_map(result, trace, result.surroundings)}</div>")
    if result.film_problem and not result.film:
        problem = f'<p class="quiet">There is no film: {escaped(result.film_problem)}.</p>'
    return (f'<div class="media">{"".join(media)}</div>' if media else "") + problem


def _film_caption(result: TrialResult) -> str:
    failed = result.failed_at
    when = "end of the run" if failed is None else f"run around the failure at {failed:.1f} s"
    return f"The {when}. The blue line is the path of the robot."


def _subtitle(result: TrialResult) -> str:
    words = [result.robot, result.surroundings.world if result.surroundings is not None else ""]
    if result.trace is not None and len(result.trace):
        words.append(f"{result.trace['time'][-1]:.1f} s simulated")
    if result.failed_at is not None:
        words.append(f"failed at {result.failed_at:.1f} s")
    return f'<span class="quiet">{escaped(" · ".join(filter(None, words)))}</span>'


def _reasons(result: TrialResult) -> list[str]:
    """Why it failed: an error, or one sentence for each bound that is not kept."""
    return [result.error] if result.error else list(result.failures)


def _status(result: TrialResult) -> str:
    return "passed" if result.passed else "failed"


def _badge(result: TrialResult) -> str:
    return f'<span class="badge {_status(result)}">{_status(result)}</span>'


def _map(result: TrialResult, trace: Trace, around: Surroundings) -> str:
    """The path on the map of the world, with a legend."""
    truth = trace.until_divergence("x", "y")
    if not len(truth):
        return ""
    odometry = trace.until_divergence("odometry_x", "odometry_y")
    touched = set(trace.touched)
    areas = [Area(part.corners, _look(part, touched), _shortened(part.name, 80)) for part in around.parts]
    areas.sort(key=lambda area: ("ground", "wall", "touched").index(area.look))
    if around.robot:
        for look, row in (("start", 0), ("end", len(truth) - 1)):
            areas.append(Area(_placed(around.robot, trace, row), look, f"the robot at the {look}"))
    names = {"goal": "goal", "reach": "target", "pass": "place to pass"}
    circles = [Circle(t.x, t.y, t.within, f"{names[t.kind]} {t.x:g}, {t.y:g}") for t in around.targets]
    # a run that diverges has no place for its last events
    times = trace["time"][: len(truth)]
    rows = ((number, int(np.searchsorted(times, event.time - 1e-9))) for number, event in _numbered(trace))
    marks = [
        Mark(float(truth[row, 0]), float(truth[row, 1]), number) for number, row in rows if row < len(truth)
    ]
    title = f"Path of {_shortened(result.title, 200)} from above"
    picture = PathPicture(title, truth, odometry if len(odometry) else truth, areas, circles, marks)
    keys = [
        _key('<path stroke="var(--plot-1)" stroke-width="3" d="M0 5h24"/>', "true path"),
        _key(
            '<path stroke="var(--plot-2)" stroke-width="3" stroke-dasharray="6 3" d="M0 5h24"/>', "odometry"
        ),
        _key(_swatch("good"), "start"),
        _key(_swatch("plot-1"), "end"),
    ]
    if circles:
        keys.append(_key(_swatch("selected"), "target"))
    if touched:
        keys.append(_key(_swatch("error"), "touched"))
    if marks:
        keys.append("<span>Numbers are the events below.</span>")
    return f"<figure>{path_svg(picture)}<figcaption>{''.join(keys)}</figcaption></figure>"


def _look(part: Outlined, touched: Collection[str]) -> str:
    if part.name in touched:
        return "touched"
    return "ground" if part.is_ground else "wall"


def _key(drawing: str, text: str) -> str:
    return f'<span class="key"><svg viewBox="0 0 24 10" aria-hidden="true">{drawing}</svg>{text}</span>'


def _swatch(colour: str) -> str:
    return (
        f'<rect x="4" y="0.5" width="16" height="9" fill="var(--{colour})" fill-opacity="0.3"'
        f' stroke="var(--{colour})"/>'
    )


def _placed(corners: Sequence[tuple[float, float]], trace: Trace, row: int) -> list[tuple[float, float]]:
    x, y, yaw = (float(trace[name][row]) for name in ("x", "y", "yaw"))
    c, s = math.cos(yaw), math.sin(yaw)
    return [(x + c * a - s * b, y + s * a + c * b) for a, b in corners]


def _numbered(trace: Trace) -> Iterator[tuple[int, Event]]:
    return enumerate(trace.events[:MOST_EVENTS], start=1)


def _measures(measures: Sequence[MeasureResult]) -> str:
    if not measures:
        return ""
    rows = []
    for measure in measures:
        status = "passed" if measure.passed else "failed"
        value = "no value" if math.isnan(measure.value) else with_unit(measure.value, measure.unit)
        description = _description(measure.name)
        more = f"<small>{escaped(description)}</small>" if description else ""
        rows.append(
            f'<tr class="{status}"><td><span class="badge {status}">{status}</span></td>'
            f'<th scope="row">{escaped(measure.name)}{more}</th><td class="number">{escaped(value)}</td>'
            f'<td>{escaped(_allowed(measure))}</td><td class="bar">{_bar(measure)}</td></tr>'
        )
    return (
        '<h3>Measures</h3><div class="table"><table><thead><tr><th scope="col">Result</th>'
        '<th scope="col">Measure</th><th scope="col">Value</th><th scope="col">Allowed</th>'
        f'<th scope="col" class="bar">Value within bounds</th></tr></thead><tbody>{"".join(rows)}</tbody>'
        "</table></div>"
    )


def _description(name: str) -> str:
    known = _DESCRIPTIONS.get(name.partition("(")[0])
    if known is not None:
        return known
    try:
        return find_measure(name).description
    except KbotError:
        return ""  # a check of a scenario in Python


def _allowed(measure: MeasureResult) -> str:
    low, high, unit = measure.min, measure.max, measure.unit
    if low is not None and high is not None:
        return f"{low:.4g} to {with_unit(high, unit)}"
    if high is not None:
        return f"at most {with_unit(high, unit)}"
    return f"at least {with_unit(low, unit)}" if low is not None else "any"


def _bar(measure: MeasureResult) -> str:
    """The value as a mark on a line, on which the allowed part is wide."""
    low, high = measure.min, measure.max
    if low is None and high is None:
        return ""
    if low is not None and high is not None:
        room = max(high - low, 1e-9 * max(abs(low), abs(high)), 1e-12)
        first, last = low - 0.6 * room, high + 0.6 * room
    elif high is not None:
        room = abs(high) or 1.0
        first, last = (0.0 if high >= 0.0 else high - 0.5 * room), high + 0.6 * room
    else:
        edge = low or 0.0
        room = abs(edge) or 1.0
        first, last = edge - 0.6 * room, edge + room
    value = measure.value
    if math.isfinite(value):
        # a value that is far away is drawn at the end, where the line has an arrow
        first = min(first, max(value - 0.1 * room, first - 3.0 * room))
        last = max(last, min(value + 0.1 * room, last + 3.0 * room))

    def x(at: float) -> float:
        return 6.0 + (at - first) / (last - first) * (_BAR_WIDTH - 12.0)

    begin, end = x(first if low is None else low), x(last if high is None else high)
    parts = [
        f'<rect y="7" width="{_BAR_WIDTH}" height="4" rx="2" fill="var(--line)"/>',
        f'<rect x="{begin:.1f}" y="5" width="{max(end - begin, 4.0):.1f}" height="8" rx="2"'
        ' fill="var(--good)" fill-opacity="0.4"/>',
    ]
    colour = "var(--good)" if measure.passed else "var(--error)"
    if math.isnan(value):
        pass
    elif value > last:
        parts.append(f'<path fill="{colour}" d="M{_BAR_WIDTH} 9l-10 -7v14z"/>')
    elif value < first:
        parts.append(f'<path fill="{colour}" d="M0 9l10 -7v14z"/>')
    else:
        parts.append(f'<circle cx="{x(value):.1f}" cy="9" r="5.5" fill="{colour}" stroke="var(--panel)"/>')
    return f'<svg viewBox="0 0 {_BAR_WIDTH} {_BAR_HEIGHT}" aria-hidden="true">{"".join(parts)}</svg>'


def _source_lines(result: TrialResult) -> str:
    if not result.source_lines:
        return ""
    shown = (
        Diagnostic("", Severity.INFO, related.message, related.origin)
        for related in result.source_lines[:MOST_FINDINGS]
    )
    return f"<h3>Source lines</h3>{''.join(map(_finding, shown))}"


def _findings(findings: Sequence[Diagnostic]) -> str:
    if not findings:
        return ""
    more = len(findings) - MOST_FINDINGS
    rest = f'<p class="quiet">{more} more findings are not shown.</p>' if more > 0 else ""
    return f"<h3>Findings about the run</h3>{''.join(map(_finding, findings[:MOST_FINDINGS]))}{rest}"


def _finding(found: Diagnostic) -> str:
    _, *frame = render_text([found]).rstrip("\n").split("\n")
    where = f'<br><code class="quiet">{escaped(place(found.origin))}</code>' if found.origin else ""
    code = f' <code class="quiet">{escaped(found.code)}</code>' if found.code else ""
    severity = f'<span class="severity {found.severity}">{found.severity}</span> ' if found.code else ""
    source = f"<pre>{_frame(frame)}</pre>" if frame else ""
    return f'<div class="finding"><p>{severity}{escaped(found.message)}{code}{where}</p>{source}</div>'


def _frame(lines: Iterable[str]) -> str:
    shown = []
    for line in lines:
        marked = _CARETS.match(line)
        carets = marked and f'{escaped(marked[1])}<span class="caret">{marked[2]}</span>'
        shown.append(carets or escaped(line))
    if shown and not shown[0].strip(" |"):
        del shown[0]  # the empty line above an excerpt
    return "\n".join(shown)


def events(trace: Trace) -> str:
    if not trace.events:
        return ""
    rows = [
        f'<li class="{escaped(event.kind)}"><span class="time">{event.time:.2f} s</span>'
        f'<span class="number">{number}</span><span>{escaped(event.text)}</span></li>'
        for number, event in _numbered(trace)
    ]
    more = len(trace.events) - MOST_EVENTS
    rest = f'<p class="quiet">{more} more events are not shown.</p>' if more > 0 else ""
    return f'<h3>Events</h3><ol class="events">{"".join(rows)}</ol>{rest}'


def _about(result: TrialResult) -> str:
    lines = []
    if result.recording:
        lines.append(f"Recording: <code>{escaped(replay_command(result))}</code>")
    if result.state_sha256:
        lines.append(f"State at the end: <code>{escaped(result.state_sha256)}</code>")
    if not result.is_deterministic:
        lines.append("This run kept real time. Another run may give other values.")
    return f"<footer>{''.join(f'<p>{line}</p>' for line in lines)}</footer>" if lines else ""


def escaped(text: str) -> str:
    """A text in HTML."""
    return xml_text.escaped(_shortened(text, MOST_CHARACTERS))


def _shortened(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"


def _media_type(film: bytes) -> str:
    if film.startswith(b"GIF8"):
        return "image/gif"
    return "image/png" if film.startswith(b"\x89PNG") else "image/webp"


def _data_uri(media_type: str, data: bytes) -> str:
    return f"data:{media_type};base64,{base64.b64encode(data).decode()}"
