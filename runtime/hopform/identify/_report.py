"""A fit as tables, JSON, a report in Markdown or HTML."""

import math
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

import numpy as np
from rich.console import RenderableType

from hopform import HopformError
from hopform._cli.output import ends, number, record, to_json
from hopform._errors import printable
from hopform._texts import in_html, markdown
from hopform.extend import table
from hopform.identify._estimation import FEWEST, Estimate
from hopform.identify._fits import NONE, Fit, Trace, missed
from hopform.identify._joint import Check, Plan

Answer = Fit | Check
SUFFIXES = (".md", ".html")


class Section(NamedTuple):
    """A table of an answer; `words` are the columns that hold no numbers."""

    title: str
    head: tuple[str, ...]
    rows: Sequence[Sequence[str]]
    words: tuple[str, ...] = ()


def fit_sections(fit: Fit) -> list[Section]:
    """Parameters with what was known last; recordings; causes that would explain the residuals better; repeats."""
    parameters = [(e.name, *rounded(e)[:1], e.unit, interval(e), e.method) for e in fit.estimates]
    parameters += [
        (name, rounded(each)[0], each.unit, "", f"as {each.name}")
        for name, other in fit.tied.items()
        for each in fit.estimates
        if each.name.partition("@")[0] == other
    ]
    parameters += [(name, number(value, ".6g"), "", "", "known") for name, value in fit.known.items()]
    recordings = list[Sequence[str]]()
    for trace in fit.traces:
        unit, factor = fit.units_of(trace).shown(trace.quantity)
        lengths = (trace.tests.rms, trace.old_rms, trace.holdout, trace.quantum or math.nan)
        row = (trace.label, str(trace.time.size), *(number(factor * value, ".4g") for value in lengths), unit)
        recordings.append((*row, f"{trace.tests.autocorrelation:.2f}", "yes" if trace.tests.white else "no"))
    unit, factor = fit.shown
    causes = [
        (("possible: " if each.possible else "") + each.cause(unit), number(factor * each.before, ".4g"),
         number(factor * each.after, ".4g"), number(each.decrease, ".3g"), each.option or "-") for each in fit.diagnoses
    ]  # fmt: skip
    repeats = [
        (each.name, ", ".join(number(value, ".4g") for value in each.values), each.unit,
         number(each.spread, ".2g"), "yes" if each.differ else "no") for each in fit.repeats
    ]  # fmt: skip
    sections = [
        Section("Parameters", ("parameter", "value", "unit", "95 % interval", "by"), parameters,
                ("parameter", "unit", "by")),
        Section("Recordings", ("recording", "samples", "rms", "rms, viscous alone", "hold-out", "quantum", "unit",
                               "autocorrelation", "white"), recordings, ("recording", "unit", "white")),
        Section("What the residuals show", ("cause", f"rms [{unit}]", f"rms with it [{unit}]", "decrease [variances]",
                                            "option"), causes, ("cause", "option")),
        Section("Repeatability of the rig", ("parameter", "each recording alone", "unit", "standard deviation",
                                             "more than noise"), repeats, ("parameter", "unit", "more than noise")),
    ]  # fmt: skip
    return [section for section in sections if section.rows]


def rounded(estimate: Estimate) -> tuple[str, str, str]:
    """A value and the ends of its interval, to two digits of its half width; to four digits without an interval."""
    half = 0.5 * (estimate.high - estimate.low)
    if not math.isfinite(half) or half <= 0.0:
        return format(estimate.value, ".4g"), format(estimate.low, ".4g"), format(estimate.high, ".4g")
    last = math.floor(math.log10(half)) - 1
    size = max(abs(estimate.value), abs(estimate.low), abs(estimate.high))
    digits = max(math.floor(math.log10(size)) - last + 1, 1) if size > 0.0 else 1
    form = f".{digits}g" if not -4 <= last <= 0 and (size >= 1e6 or size < 1e-4) else f".{max(-last, 0)}f"
    low, value, high = (format(round(number, -last), form) for number in (estimate.low, estimate.value, estimate.high))
    return value, low, high


def interval(estimate: Estimate) -> str:
    """The interval of a value in a table; "-" where neither end is known."""
    _, low, high = rounded(estimate)
    return f"{low} .. {high}" if math.isfinite(estimate.low) or math.isfinite(estimate.high) else "-"


def verdict(fit: Fit) -> str:
    """What to make of a fit, in a sentence."""
    shared = [each for each in fit.estimates if not each.own]
    given = [each for each in shared if math.isfinite(each.high - each.low)]
    if any(missed(trace) for trace in fit.traces):
        return "The fit misses the motion: use none of its numbers."
    if not given and any(each.method == "too few samples" for each in shared):
        return _too_few(fit)
    if not given and any(each.method == NONE for each in shared):
        return f"The model does not explain the recordings: values are off by an unknown amount{_agreement(fit)}."
    if not given:
        return "No parameter has an interval with two ends; the notes say what these recordings do not identify."
    return "The model explains these recordings to their noise. Change amplitude or load to see whether it holds."


def _agreement(fit: Fit) -> str:
    """How far the values of several recordings of one rig agree; nothing of one."""
    shares = [np.ptp(each.values) / max(abs(float(np.mean(each.values))), 1e-300) for each in fit.repeats]
    if not shares:
        return ""
    least = [f"{each.name} within {100.0 * share:.2g} %" for each, share in zip(fit.repeats, shares, strict=True)]
    return f"; from recording to recording they agree: {', '.join(least)}"


def _too_few(fit: Fit) -> str:
    """Why there are too few samples: few of them, or few that are independent."""
    solution, none = fit.solution, "Too few samples for an interval: record for longer."
    if solution is None or solution.count < FEWEST * len(solution.parameters):
        return none
    return (
        f"Too few independent samples, {solution.effective:.0f} of {solution.count}, because the encoder's rounding stays "
        "alike from sample to sample: there are no intervals. Use a finer encoder, or let it move faster or further."
    )


def results(fit: Fit) -> list[str]:
    """The parameters with their intervals, a line each."""
    lines = list[str]()
    for estimate in fit.estimates:
        if not estimate.own and estimate.method != "not identifiable":
            value, low, high = rounded(estimate)
            ends = f" ({low} .. {high})" if math.isfinite(estimate.low) or math.isfinite(estimate.high) else ""
            lines.append(f"{estimate.name} = {value} {estimate.unit}".rstrip() + ends)
    return lines


def check_sections(check: Check) -> list[Section]:
    """Recordings as they were sampled, and the intervals to expect."""
    unit, drive = check.units.shown("x1")[0], f"drive [{check.units.drive}]"
    sizes = (f"{name} [{unit}]" for name in ("noise", "quantum", "travel"))
    head = ("recording", "role", "samples", "s", "Hz", *sizes, drive, "outliers")
    rows = [
        (
            one.source, one.role, str(one.samples), number(one.duration), number(one.rate),
            number(1e3 * one.noise, ".3g"), number(1e3 * one.quantum, ".3g"), number(1e3 * one.travel, ".4g"),
            ends(one.lowest, one.highest, ".3g"), str(one.outliers),
        ) for one in check.recordings
    ]  # fmt: skip
    some = [each for each in check.expected if not each.own]
    expected = [(e.name, number(e.value, ".6g"), e.unit, number(0.5 * (e.high - e.low), ".3g"), e.method) for e in some]
    about = ("parameter", "about", "unit", "95 % +-", "by")
    sampled = Section("Recordings", head, rows, ("recording", "role", drive))
    return [sampled, Section("Intervals to expect", about, expected, ("parameter", "unit", "by"))]


def strong_correlations(fit: Fit) -> Iterator[str]:
    """Parameters that the data hardly separate, in words."""
    strong = [f"{a} with {b} {r:+.3f}" for (a, b), r in fit.correlations.items() if abs(r) > 0.9]
    if strong:
        yield f"strong correlations: {', '.join(strong)}"


def parts_of(answer: Answer) -> tuple[list[Section], list[str]]:
    """The tables of an answer, and what it says beside them."""
    if isinstance(answer, Fit):
        return fit_sections(answer), []
    return check_sections(answer), []


def tables_of(answer: Answer) -> Iterator[RenderableType]:
    """An answer for a terminal."""
    sections, words = parts_of(answer)
    if isinstance(answer, Fit):
        yield verdict(answer)
    yield from (table(*section) for section in sections)
    yield from (strong_correlations(answer) if isinstance(answer, Fit) else words)
    yield from (f"note: {each}" for each in answer.statements)


def plan_of(plan: Plan) -> Iterator[RenderableType]:
    """A plan for a terminal: what to record, in its order."""
    rows = [
        (str(n), each.test, f"{each.setting} {each.value:.3g} {each.unit}", f"{each.duration:g}",
         ", ".join(f"{name} {100.0 * share:.2g} %" for name, share in each.gives.items()) or "-")
        for n, each in enumerate(plan.steps, 1)
    ]  # fmt: skip
    head = ("", "record", "amplitude", "s", "identifies, 95 % within")
    yield table("What to record", head, rows, ("record", "amplitude", "identifies, 95 % within"))
    yield from (f"note: {each}" for each in plan.statements)


def fit_json(fit: Fit) -> str:
    """A fit for JSON; the covariance is that of what is identifiable."""
    seen = [n for n, each in enumerate(fit.estimates) if each.method != "not identifiable"]
    covariance = [fit.estimates[n].name for n in seen], fit.covariance[np.ix_(seen, seen)]
    recordings = [
        record("recording", each.tests, source=each.label, quantity=fit.called(each), samples=each.time.size,
               rms_viscous=each.old_rms, holdout=each.holdout, quantum=each.quantum) for each in fit.traces
    ]  # fmt: skip
    correlations = [(*pair, value) for pair, value in fit.correlations.items()]
    tables = {"covariance": covariance, "correlations": correlations, "recordings": recordings}
    return to_json("identify", fit, parameters=fit.estimates, **tables)


def json_of(answer: Answer) -> str:
    """An answer for JSON."""
    if isinstance(answer, Fit):
        return fit_json(answer)
    return to_json("identify check", answer, kind="check")


# ---- reports ----


def check_suffix(path: Path) -> None:
    """Raise HopformError for a report whose name does not end in .md or .html."""
    if path.suffix.lower() not in SUFFIXES:
        raise HopformError(f"a report's name must end in {' or '.join(SUFFIXES)}, got {str(path)!r}")


def paths_of(path: Path) -> tuple[Path, ...]:
    """The files that a report is written to: an HTML page, or Markdown and the picture beside it."""
    return (path,) if path.suffix.lower() == ".html" else (path, path.with_suffix(".svg"))


def files_of(answer: Fit, path: Path) -> list[tuple[Path, bytes]]:
    """The files of a report and what is in them; an HTML page has its picture inside."""
    from hopform._figures import figure_of
    from hopform._figures.plots import render

    check_suffix(path)
    picture = render(figure_of(answer), ".svg")
    sections, statements = parts_of(answer)
    if pairs := [(a, b, f"{r:+.3f}") for (a, b), r in answer.correlations.items()]:
        sections.append(Section("Correlations", ("first", "second", "correlation"), pairs))
    statements += [rms_of(answer, trace) for trace in answer.traces if not math.isnan(trace.old_rms)]
    statements += [*answer.statements, *answer.warnings, *answer.origin]
    title = f"Identification: {answer.title}"
    page_path, *beside = paths_of(path)
    shown = quote(os.fsencode(beside[0].name)) if beside else picture.decode()
    page = Page(title, verdict(answer), results(answer), shown, sections, statements)
    text = (_markdown if beside else _html)(page)
    # what is not UTF-8 in the name of a file is shown as the bytes that it is
    return [(page_path, text.encode("utf-8", "backslashreplace")), *((each, picture) for each in beside)]


class Page(NamedTuple):
    """A report in the order in which it is read."""

    title: str
    verdict: str
    results: Sequence[str]
    picture: str
    sections: Sequence[Section]
    statements: Sequence[str]


def rms_of(fit: Fit, trace: Trace) -> str:
    """How well both models meet a recording, in words."""
    (unit, factor), (old, new) = fit.units_of(trace).shown(trace.quantity), fit.rivals
    after, before = (f"{factor * rms:.3g} {unit}" for rms in (trace.tests.rms, trace.old_rms))
    by = "by " if fit.base is None else ""  # equations
    return f"{Path(trace.label).name}: rms {after} {by}{new}; {before} {by}{old}"


def _markdown(page: Page) -> str:
    def tables(sections: Sequence[Section]) -> Iterator[str]:
        for heading, head, rows, _ in sections:
            yield from (f"## {heading}", "", "| " + " | ".join(head) + " |", "|" + "---|" * len(head))
            yield from ("| " + " | ".join(map(markdown, row)) + " |" for row in rows)
            yield ""

    parts = [f"# {page.title}", "", markdown(page.verdict), "", *(f"- {markdown(each)}" for each in page.results), ""]
    parts += [f"![the fit]({page.picture})", "", *tables(page.sections)]
    items = [f"- {markdown(each)}" for each in page.statements]
    return "\n".join([*parts, "## What the data identify", "", *items, ""])


def _html(page: Page) -> str:
    """A page that a phone shows: a table that is wider than it scrolls by itself."""

    def text(words: str) -> str:
        return in_html(printable(words))

    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{text(cell)}</{tag}>" for cell in cells) + "</tr>"

    def tables(sections: Sequence[Section]) -> Iterator[str]:
        for heading, head, rows, _ in sections:
            yield from (f"<h2>{heading}</h2>", '<div class="wide"><table>', row(head, "th"))
            yield from (row(cells, "td") for cells in rows)
            yield "</table></div>"

    style = (
        "body{font:15px sans-serif;max-width:62em;margin:2em auto;padding:0 1em}.wide{overflow-x:auto}"
        "table{border-collapse:collapse}svg{max-width:100%;height:auto}li{overflow-wrap:anywhere}"
        "td,th{padding:.2em .7em;text-align:left;border-bottom:1px solid #ddd;font-variant-numeric:tabular-nums}"
    )
    name = in_html(page.title)
    viewport = '<meta name="viewport" content="width=device-width,initial-scale=1">'
    parts = [
        "<!DOCTYPE html>", f'<html lang="en"><head><meta charset="utf-8">{viewport}<title>{name}</title>',
        f"<style>{style}</style></head><body>", f"<h1>{name}</h1>", f"<p>{text(page.verdict)}</p>",
        "<ul>", *(f"<li>{text(each)}</li>" for each in page.results), "</ul>",
        page.picture[page.picture.index("<svg") :], *tables(page.sections),
    ]  # fmt: skip
    items = [f"<li>{text(each)}</li>" for each in page.statements]
    return "\n".join([*parts, "<h2>What the data identify</h2>", "<ul>", *items, "</ul>", "</body></html>", ""])
