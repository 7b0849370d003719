"""A fit as tables, JSON, a report in Markdown or HTML."""

import html
import math
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np
from rich.console import RenderableType

from hopform._cli.render import number, pick, table
from hopform._errors import HopformError, printable
from hopform._identify.checks import Check
from hopform._identify.fits import NEW, OLD, TITLES, Fit
from hopform._identify.ramp import Threshold
from hopform._identify.units import Units

Answer = Fit | Threshold | Check
SUFFIXES = (".md", ".html")


def parameter_rows(fit: Fit) -> list[tuple[str, ...]]:
    """Name, value, unit, interval and how it was found, of each parameter; what was known last."""
    rows: list[tuple[str, ...]] = [
        (e.name, number(e.value, ".6g"), e.unit, f"{number(e.low, '.6g')} .. {number(e.high, '.6g')}", e.method)
        for e in fit.estimates
    ]
    return rows + [(name, number(value, ".6g"), "", "", "known") for name, value in fit.known.items()]


def trace_rows(fit: Fit) -> list[tuple[str, ...]]:
    """Each recording: samples, rms under both models, hold-out error, the encoder's step, autocorrelation."""
    rows = list[tuple[str, ...]]()
    for trace in fit.traces:
        unit, factor = fit.units.shown(trace.quantity)
        lengths = (trace.tests.rms, trace.old_rms, trace.holdout, trace.quantum or math.nan)
        rows.append((
            trace.label, str(trace.time.size), *(number(factor * value, ".4g") for value in lengths), unit,
            f"{trace.tests.autocorrelation:.2f}", "yes" if trace.tests.white else "no",
        ))  # fmt: skip
    return rows


PARAMETER_HEAD = ("parameter", "value", "unit", "95 % interval", "by")
TRACE_HEAD = (
    "recording", "samples", "rms", "rms, viscous alone", "hold-out", "quantum", "unit", "autocorrelation", "white",
)  # fmt: skip


def onset_head(units: Units) -> tuple[str, ...]:
    return "recording", "direction of x1", "t [s]", f"u [{units.drive}]", "95 % interval"


def diagnosis_rows(fit: Fit) -> list[tuple[str, ...]]:
    """Each cause that would explain the residuals better."""
    _, factor = fit.shown
    return [
        (each.cause(), number(factor * each.before, ".4g"), number(factor * each.after, ".4g"),
         number(each.decrease, ".3g"), each.option or "-") for each in fit.diagnoses
    ]  # fmt: skip


def repeat_rows(fit: Fit) -> list[tuple[str, ...]]:
    """Each parameter of several recordings alone, both intervals, and which to quote."""
    return [
        (each.name, ", ".join(number(value, ".4g") for value in each.values), each.unit,
         f"{each.low:.4g} .. {each.high:.4g}", f"{each.fitted_low:.4g} .. {each.fitted_high:.4g}", each.quote)
        for each in fit.repeats
    ]  # fmt: skip


def diagnosis_head(fit: Fit) -> tuple[str, ...]:
    unit, _ = fit.shown
    return "cause", f"rms [{unit}]", f"rms with it [{unit}]", "decrease [variances]", "option"


REPEAT_HEAD = ("parameter", "each recording alone", "unit", "their mean, 95 %", "fit, 95 %", "quote")


def fit_tables(fit: Fit) -> Iterator[RenderableType]:
    """A fit for a terminal."""
    yield table("Parameters", PARAMETER_HEAD, parameter_rows(fit), ("parameter", "unit", "by"))
    yield table("Recordings", TRACE_HEAD, trace_rows(fit), ("recording", "unit", "white"))
    if fit.diagnoses:
        yield table("What the residuals show", diagnosis_head(fit), diagnosis_rows(fit), ("cause", "option"))
    if fit.repeats:
        yield table("Repeats", REPEAT_HEAD, repeat_rows(fit), ("parameter", "unit", "quote"))
    strong = [(a, b, r) for (a, b), r in fit.correlations.items() if abs(r) > 0.9]
    if strong:
        yield "strong correlations: " + ", ".join(f"{a} with {b} {r:+.3f}" for a, b, r in strong)
    yield from (f"note: {each}" for each in fit.statements)


def threshold_rows(threshold: Threshold) -> list[tuple[str, ...]]:
    return [
        (o.source, f"{o.direction:+d}", number(o.time), number(o.u), f"{number(o.u_low)} .. {number(o.u_high)}")
        for o in threshold.onsets
    ]  # fmt: skip


def threshold_said(threshold: Threshold) -> Iterator[str]:
    """A threshold as a row of the table."""
    drive = threshold.units.drive
    yield f"u* = {threshold.u:.5g} {drive}, 95 % interval {threshold.low:.5g} .. {threshold.high:.5g} {drive}"
    if not math.isnan(threshold.load):
        yield f"constant load: {threshold.load:.4g} {drive}"
    if not math.isnan(threshold.f1):
        unit = threshold.units.of("m/s^2")
        yield f"f1 = {threshold.f1:.5g} {unit}, {threshold.f1_low:.5g} .. {threshold.f1_high:.5g}"


def threshold_tables(threshold: Threshold) -> Iterator[RenderableType]:
    """A threshold for a terminal."""
    yield table("Onsets of motion", onset_head(threshold.units), threshold_rows(threshold), ("recording",))
    yield from threshold_said(threshold)
    yield from (f"note: {each}" for each in threshold.statements)


def covariance_record(fit: Fit) -> dict[str, Any]:
    """The covariance of what is identifiable, for JSON."""
    seen = [n for n, each in enumerate(fit.estimates) if each.method != "not identifiable"]
    names = [fit.estimates[n].name for n in seen]
    return {"names": names, "rows": fit.covariance[np.ix_(seen, seen)].tolist()}


def fit_record(fit: Fit) -> dict[str, Any]:
    """A fit for JSON."""
    return {
        "kind": fit.kind,
        "parameters": fit.estimates,
        "known": fit.known,
        "covariance": covariance_record(fit),
        "correlations": [{"first": a, "second": b, "value": r} for (a, b), r in fit.correlations.items()],
        "diagnoses": fit.diagnoses,
        "recordings": [
            {
                "source": trace.label, "quantity": trace.quantity, "samples": trace.time.size, "rms": trace.tests.rms,
                "rms_viscous": trace.old_rms, "holdout": trace.holdout, "largest": trace.tests.largest,
                "quantum": trace.quantum, **pick(trace.tests, "autocorrelation", "runs_z", "white"),
            }
            for trace in fit.traces
        ],
        **pick(fit, "repeats", "statements", "warnings", "evaluations", "seconds", "units"),
    }  # fmt: skip


def threshold_record(threshold: Threshold) -> dict[str, Any]:
    """A threshold for JSON."""
    names = ("u", "low", "high", "load", "f1", "f1_low", "f1_high", "onsets", "statements", "warnings", "units")
    return {"kind": "ramp", **pick(threshold, *names)}


def check_tables(check: Check) -> Iterator[RenderableType]:
    """A check for a terminal."""
    unit, drive = check.units.shown("x1")[0], f"drive [{check.units.drive}]"
    head: tuple[str, ...] = (
        "recording", "role", "samples", "s", "Hz", f"noise [{unit}]", f"quantum [{unit}]", f"travel [{unit}]", drive,
        "outliers",
    )  # fmt: skip
    rows: list[tuple[str, ...]] = [
        (
            one.source, one.role, str(one.samples), number(one.duration), number(one.rate),
            number(1e3 * one.noise, ".3g"), number(1e3 * one.quantum, ".3g"), number(1e3 * one.travel, ".4g"),
            f"{one.lowest:.3g} .. {one.highest:.3g}", str(one.outliers),
        ) for one in check.recordings
    ]  # fmt: skip
    yield table("Recordings", head, rows, ("recording", "role", drive))
    ends = [
        (e.name, number(e.value, ".6g"), e.unit, number(0.5 * (e.high - e.low), ".3g"), e.method)
        for e in check.expected if not e.own
    ]  # fmt: skip
    head = ("parameter", "about", "unit", "95 % +-", "by")
    yield table("Intervals to expect", head, ends, ("parameter", "unit", "by"))
    yield from (f"note: {each}" for each in check.statements)


def tables_of(answer: Answer) -> Iterator[RenderableType]:
    """An answer for a terminal."""
    if isinstance(answer, Check):
        return check_tables(answer)
    return fit_tables(answer) if isinstance(answer, Fit) else threshold_tables(answer)


def record_of(answer: Answer) -> dict[str, Any]:
    """An answer for JSON."""
    if isinstance(answer, Check):
        return {"kind": "check", **answer._asdict()}
    return fit_record(answer) if isinstance(answer, Fit) else threshold_record(answer)


# ---- reports ----


def check_suffix(path: Path) -> None:
    """Raise HopformError for a report whose name does not end in .md or .html."""
    if path.suffix.lower() not in SUFFIXES:
        raise HopformError(f"a report's name must end in {' or '.join(SUFFIXES)}, got {str(path)!r}")


def paths_of(path: Path) -> tuple[Path, ...]:
    """The files that a report is written to: an HTML page, or Markdown and the picture beside it."""
    return (path,) if path.suffix.lower() == ".html" else (path, path.with_suffix(".svg"))


def files_of(answer: Fit | Threshold, path: Path) -> list[tuple[Path, bytes]]:
    """The files of a report and what is in them; an HTML page has its picture inside."""
    from hopform._figures import plots, results

    check_suffix(path)
    picture = plots.render(results.figure_of(answer), ".svg")
    page = _fit_page(answer) if isinstance(answer, Fit) else _threshold_page(answer)
    page_path, *beside = paths_of(path)
    if not beside:
        return [(page_path, _encoded(_html(page, picture.decode())))]
    return [(page_path, _encoded(_markdown(page, quote(os.fsencode(beside[0].name))))), (beside[0], picture)]


def _encoded(text: str) -> bytes:
    """A page in UTF-8; what is not UTF-8 in the name of a file is shown as the bytes that it is."""
    return text.encode("utf-8", "backslashreplace")


class _Section(NamedTuple):
    """A table of a report."""

    title: str
    head: tuple[str, ...]
    rows: list[tuple[str, ...]]


class _Page(NamedTuple):
    """The text of a report."""

    title: str
    sections: list[_Section]
    statements: list[str]


def _fit_page(fit: Fit) -> _Page:
    pairs: list[tuple[str, ...]] = [(a, b, f"{r:+.3f}") for (a, b), r in fit.correlations.items()]
    sections = [
        _Section("Parameters", PARAMETER_HEAD, parameter_rows(fit)),
        _Section("Recordings", TRACE_HEAD, trace_rows(fit)),
        _Section("What the residuals show", diagnosis_head(fit), diagnosis_rows(fit)),
        _Section("Repeats", REPEAT_HEAD, repeat_rows(fit)),
        _Section("Correlations", ("first", "second", "correlation"), pairs),
    ]
    compared = [trace for trace in fit.traces if not math.isnan(trace.old_rms)]
    statements = list[str]()
    for trace in compared:
        unit, factor = fit.units.shown(trace.quantity)
        new, old = (f"{factor * rms:.3g} {unit}" for rms in (trace.tests.rms, trace.old_rms))
        statements.append(f"{Path(trace.label).name}: rms {new} by {NEW}; {old} by {OLD}")
    return _Page(
        TITLES[fit.kind], [each for each in sections if each.rows], [*statements, *fit.statements, *fit.warnings]
    )


def _threshold_page(threshold: Threshold) -> _Page:
    section = _Section("Onsets of motion", onset_head(threshold.units), threshold_rows(threshold))
    return _Page(TITLES["ramp"], [section], [*threshold_said(threshold), *threshold.statements, *threshold.warnings])


def _markdown(page: _Page, picture: str) -> str:
    parts = [f"# Identification: {page.title}", ""]
    for title, head, rows in page.sections:
        parts += [f"## {title}", "", "| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
        parts += ["| " + " | ".join(map(markdown, row)) + " |" for row in rows] + [""]
    statements = [f"- {markdown(each)}" for each in page.statements]
    return "\n".join([*parts, "## What the data identify", "", *statements, "", f"![the fit]({picture})", ""])


_MARKUP = re.compile(r"[\\`*{}\[\]<>#|&$~]|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9])")


def markdown(text: str) -> str:
    """A text in one line of Markdown that is shown as it is: no markup, no HTML, no formula, no cell's end."""
    return _MARKUP.sub(r"\\\g<0>", printable(" ".join(text.split())))


def _html(page: _Page, picture: str) -> str:
    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(printable(cell))}</{tag}>" for cell in cells) + "</tr>"

    style = (
        "body{font:15px sans-serif;max-width:62em;margin:2em auto}"
        "table{border-collapse:collapse}svg{max-width:100%;height:auto}"
        "td,th{padding:.2em .7em;text-align:left;border-bottom:1px solid #ddd;font-variant-numeric:tabular-nums}"
    )
    title = f"Identification: {html.escape(page.title)}"
    parts = [
        "<!DOCTYPE html>", f'<html lang="en"><head><meta charset="utf-8"><title>{title}</title>',
        f"<style>{style}</style></head><body>", f"<h1>{title}</h1>",
    ]  # fmt: skip
    for heading, head, rows in page.sections:
        parts += [f"<h2>{heading}</h2>", "<table>", row(head, "th"), *(row(cells, "td") for cells in rows), "</table>"]
    parts += [
        "<h2>What the data identify</h2>",
        "<ul>",
        *(f"<li>{html.escape(printable(each))}</li>" for each in page.statements),
        "</ul>",
    ]
    return "\n".join([*parts, picture[picture.index("<svg") :], "</body></html>", ""])
