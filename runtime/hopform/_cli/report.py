"""A fit as tables, JSON, a picture, a report in Markdown or HTML."""

# pyright: reportUnknownMemberType=false
# matplotlib's own annotations leave the type of **kwargs open.

import html
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import quote

import numpy as np
from rich.console import RenderableType

from hopform._cli.render import number, pick, table
from hopform._errors import HopformError, printable
from hopform._identify.checks import Check
from hopform._identify.estimation import Estimate
from hopform._identify.fits import NEW, OLD, Fit, Trace
from hopform._identify.ramp import Rise, Threshold
from hopform._identify.units import Units

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Answer = Fit | Threshold | Check
SUFFIXES = (".md", ".html")
TITLES = {
    "drop": "drop test", "step": "step response", "force": "in force", "robot": "all recordings together",
    "ramp": "friction threshold (5) from a ramp",
}  # fmt: skip
"""Headings by kind of answer."""


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


# ---- pictures ----


def plot(answer: Fit | Threshold) -> "Figure":
    """The picture of a fit, or of a threshold."""
    return plot_fit(answer) if isinstance(answer, Fit) else plot_threshold(answer)


def plot_fit(fit: Fit) -> "Figure":
    """Each recording with both models, the residuals over time, position and velocity, then the intervals of the
    parameters and their correlations.
    """
    from matplotlib.figure import Figure

    from hopform._figures import plots

    traces, shown = [trace for trace in fit.traces if trace.time.size > 1], _with_intervals(fit)
    names = list(dict.fromkeys(name for pair in fit.correlations for name in pair))
    last = 0.7 + 0.22 * max(len(shown), len(names))
    with plots.house_style():
        figure = Figure(figsize=(8.0, 4.2 * len(traces) + last), layout="constrained")
        heights = [*([2.0, 1.0, 1.0] * len(traces)), max(last, 1.0)]
        grid = figure.add_gridspec(len(heights), 2, height_ratios=heights)
        for n, trace in enumerate(traces):
            above, below = (figure.add_subplot(grid[3 * n + row, :]) for row in range(2))
            left, right = (figure.add_subplot(grid[3 * n + 2, column]) for column in range(2))
            _draw_trace(above, below, trace, fit.units)
            _draw_residuals(left, right, trace, fit.units)
        _draw_intervals(figure.add_subplot(grid[-1, 0] if names else grid[-1, :]), shown)
        if names:
            _draw_correlations(figure.add_subplot(grid[-1, 1]), fit.correlations, names)
        figure.suptitle(f"Identification: {TITLES[fit.kind]}")
    return figure


def _draw_residuals(left: "Axes", right: "Axes", trace: Trace, units: Units) -> None:
    """Residuals over position, where a guide shows, and over velocity, where a friction law does."""
    from hopform._figures import plots

    unit, factor = units.shown(trace.quantity)
    residual = factor * (trace.predicted - trace.measured)
    rate = factor * np.gradient(trace.predicted, trace.time)
    for axes, over, label in ((left, factor * trace.predicted, f"{trace.quantity} [{unit}]"),
                              (right, rate, f"d {trace.quantity}/dt [{unit}/s]")):  # fmt: skip
        axes.plot(over, residual, ".", ms=1.5, color=plots.BLUE)
        axes.set(xlabel=label)
    left.set(ylabel=f"residual [{unit}]")


def _draw_correlations(axes: "Axes", correlations: Mapping[tuple[str, str], float], names: Sequence[str]) -> None:
    """Correlations of the parameters from -1, blue, to 1, red."""
    at = {name: n for n, name in enumerate(names)}
    table = np.eye(len(names))
    for (first, second), value in correlations.items():
        table[at[first], at[second]] = table[at[second], at[first]] = value
    axes.imshow(table, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    axes.set(xticks=range(len(names)), yticks=range(len(names)), xlabel="correlations")
    axes.set_xticklabels(names, rotation=90)
    axes.set_yticklabels(names)
    axes.grid(visible=False)


def _draw_trace(above: "Axes", below: "Axes", trace: Trace, units: Units) -> None:
    from hopform._figures import plots

    unit, factor = units.shown(trace.quantity)
    above.plot(trace.time, factor * trace.measured, ".", ms=2, color=plots.GREY, label="measured")
    if trace.old is not None:
        above.plot(trace.time, factor * trace.old, "--", lw=0.9, color=plots.MAGENTA, label=OLD)
        below.plot(trace.time, factor * (trace.old - trace.measured), lw=0.6, color=plots.MAGENTA)
    above.plot(trace.time, factor * trace.predicted, lw=1.1, color=plots.BLUE, label=NEW)
    below.plot(trace.time, factor * (trace.predicted - trace.measured), lw=0.6, color=plots.BLUE)
    above.set(ylabel=f"{trace.quantity} [{unit}]", xticklabels=[])
    above.set_title(plots.literal(Path(trace.label).name), loc="left", fontsize=9)
    ends = (float(trace.time[0]), float(trace.time[-1]))
    above.set_xlim(ends)
    below.set_xlim(ends)
    below.set(xlabel="t [s]", ylabel=f"residual [{unit}]")
    above.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=7, frameon=False)


def _with_intervals(fit: Fit) -> list[Estimate]:
    """Estimates whose interval is shown as a share of the value: none that may have either sign, none of one
    recording.
    """
    return [
        each for each in fit.estimates
        if not each.own and math.isfinite(each.high - each.low) and each.high - each.low < 2.0 * abs(each.value)
    ]  # fmt: skip


def _draw_intervals(axes: "Axes", shown: Sequence[Estimate]) -> None:
    """95 % intervals as shares of the values, on a scale that shows small and large ones."""
    from hopform._figures import plots

    for row, each in enumerate(reversed(shown)):
        ends = 100.0 * (np.array([each.low, each.high]) - each.value) / abs(each.value)
        axes.plot(ends, [row, row], "|-", color=plots.BLUE)
        axes.plot([0.0], [row], "o", ms=3, color=plots.BLUE)
    axes.set(xlabel="95 % interval about the value [%]", yticks=range(len(shown)))
    axes.set_xscale("symlog", linthresh=0.1)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set_yticklabels([each.name for each in reversed(shown)])
    axes.margins(x=0.05, y=0.1)


def plot_threshold(threshold: Threshold) -> "Figure":
    """Each onset of motion with the motion that fits it, its time and interval, and the current over the same time."""
    from matplotlib.figure import Figure

    from hopform._figures import plots

    with plots.house_style():
        figure = Figure(figsize=(8.0, 3.1 * len(threshold.rises) + 0.4), layout="constrained")
        grid = figure.subplots(2 * len(threshold.rises), 1, height_ratios=[2.0, 1.0] * len(threshold.rises))
        for n, rise in enumerate(threshold.rises):
            _draw_rise(grid[2 * n], grid[2 * n + 1], rise, threshold.units)
        figure.suptitle(f"Identification: {TITLES['ramp']}")
    return figure


def _draw_rise(above: "Axes", below: "Axes", rise: Rise, units: Units) -> None:
    from hopform._figures import plots

    onset, begin = rise.onset, float(rise.time[0])
    above.plot(rise.time, 1e3 * rise.x1, ".", ms=2, color=plots.GREY, label="measured")
    above.plot(rise.time, 1e3 * rise.fitted, lw=1.1, color=plots.BLUE, label="rest, then a rise")
    below.plot(rise.time, rise.u, lw=0.8, color=plots.BLUE)
    for axes in (above, below):
        axes.axvspan(onset.time_low, onset.time_high, color=plots.MAGENTA, alpha=0.2, label="onset, 95 %")
        axes.axvline(onset.time, color=plots.MAGENTA, lw=0.9)
        axes.set_xlim(begin, float(rise.time[-1]))
    below.axhspan(onset.u_low, onset.u_high, color=plots.GREY, alpha=0.3)
    above.set(ylabel=f"x1 [{units.shown('x1')[0]}]", xticklabels=[])
    source = plots.literal(Path(onset.source).name)
    above.set_title(f"{source}, direction {onset.direction:+d}", loc="left", fontsize=9)
    below.set(xlabel="t [s]", ylabel=f"u [{units.drive}]")
    above.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=7, frameon=False)


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
    from hopform._figures import plots

    check_suffix(path)
    picture = plots.render(plot(answer), ".svg")
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
