"""A fit as tables, JSON, a report in Markdown or HTML."""

import html
import math
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

import numpy as np
from rich.console import RenderableType

from hopform._cli.output import ends, number, record, table, to_json
from hopform._errors import HopformError, printable
from hopform._identify.fits import NEW, OLD, TITLES, Fit, Trace
from hopform._identify.joint import Check

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
    parameters = [(e.name, number(e.value, ".6g"), e.unit, ends(e.low, e.high, ".6g"), e.method) for e in fit.estimates]
    parameters += [(name, number(value, ".6g"), "", "", "known") for name, value in fit.known.items()]
    recordings = list[Sequence[str]]()
    for trace in fit.traces:
        unit, factor = fit.units.shown(trace.quantity)
        lengths = (trace.tests.rms, trace.old_rms, trace.holdout, trace.quantum or math.nan)
        row = (trace.label, str(trace.time.size), *(number(factor * value, ".4g") for value in lengths), unit)
        recordings.append((*row, f"{trace.tests.autocorrelation:.2f}", "yes" if trace.tests.white else "no"))
    unit, factor = fit.shown
    causes = [
        (each.cause(unit), number(factor * each.before, ".4g"), number(factor * each.after, ".4g"),
         number(each.decrease, ".3g"), each.option or "-") for each in fit.diagnoses
    ]  # fmt: skip
    repeats = [
        (each.name, ", ".join(number(value, ".4g") for value in each.values), each.unit,
         ends(each.low, each.high, ".4g"), ends(each.fitted_low, each.fitted_high, ".4g"), each.quote)
        for each in fit.repeats
    ]  # fmt: skip
    found = [
        Section("Parameters", ("parameter", "value", "unit", "95 % interval", "by"), parameters,
                ("parameter", "unit", "by")),
        Section("Recordings", ("recording", "samples", "rms", "rms, viscous alone", "hold-out", "quantum", "unit",
                               "autocorrelation", "white"), recordings, ("recording", "unit", "white")),
        Section("What the residuals show", ("cause", f"rms [{unit}]", f"rms with it [{unit}]", "decrease [variances]",
                                            "option"), causes, ("cause", "option")),
        Section("Repeats", ("parameter", "each recording alone", "unit", "their mean, 95 %", "fit, 95 %", "quote"),
                repeats, ("parameter", "unit", "quote")),
    ]  # fmt: skip
    return [section for section in found if section.rows]


def check_sections(check: Check) -> list[Section]:
    """Recordings as they were sampled, and the intervals to expect."""
    unit, drive = check.units.shown("x1")[0], f"drive [{check.units.drive}]"
    sizes = (f"{name} [{unit}]" for name in ("noise", "quantum", "travel"))
    head = ("recording", "role", "samples", "s", "Hz", *sizes, drive, "outliers")
    rows = [
        (
            one.source, one.role, str(one.samples), number(one.duration), number(one.rate),
            number(1e3 * one.noise, ".3g"), number(1e3 * one.quantum, ".3g"), number(1e3 * one.travel, ".4g"),
            f"{one.lowest:.3g} .. {one.highest:.3g}", str(one.outliers),
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
    yield from (table(*section) for section in sections)
    yield from (strong_correlations(answer) if isinstance(answer, Fit) else words)
    yield from (f"note: {each}" for each in answer.statements)


def fit_json(fit: Fit) -> str:
    """A fit for JSON; the covariance is that of what is identifiable."""
    seen = [n for n, each in enumerate(fit.estimates) if each.method != "not identifiable"]
    covariance = [fit.estimates[n].name for n in seen], fit.covariance[np.ix_(seen, seen)]
    recordings = [
        record("recording", each.tests, source=each.label, quantity=each.quantity, samples=each.time.size,
               rms_viscous=each.old_rms, holdout=each.holdout, quantum=each.quantum) for each in fit.traces
    ]  # fmt: skip
    correlations = [(*pair, value) for pair, value in fit.correlations.items()]
    own = {"covariance": covariance, "correlations": correlations, "recordings": recordings}
    return to_json("identify", fit, parameters=fit.estimates, **own)


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
    from hopform._figures import plots, results

    check_suffix(path)
    picture = plots.render(results.figure_of(answer), ".svg")
    sections, statements = parts_of(answer)
    if isinstance(answer, Fit):
        if pairs := [(a, b, f"{r:+.3f}") for (a, b), r in answer.correlations.items()]:
            sections.append(Section("Correlations", ("first", "second", "correlation"), pairs))
        statements += [rms_of(answer, trace) for trace in answer.traces if not math.isnan(trace.old_rms)]
    statements += [*answer.statements, *answer.warnings]
    title = f"Identification: {TITLES[answer.kind]}"
    page_path, *beside = paths_of(path)
    shown = quote(os.fsencode(beside[0].name)) if beside else picture.decode()
    text = (_markdown if beside else _html)(title, sections, statements, shown)
    # what is not UTF-8 in the name of a file is shown as the bytes that it is
    return [(page_path, text.encode("utf-8", "backslashreplace")), *((each, picture) for each in beside)]


def rms_of(fit: Fit, trace: Trace) -> str:
    """How well both models meet a recording, in words."""
    unit, factor = fit.units.shown(trace.quantity)
    new, old = (f"{factor * rms:.3g} {unit}" for rms in (trace.tests.rms, trace.old_rms))
    return f"{Path(trace.label).name}: rms {new} by {NEW}; {old} by {OLD}"


def _markdown(title: str, sections: Sequence[Section], statements: Sequence[str], picture: str) -> str:
    parts = [f"# {title}", ""]
    for heading, head, rows, _ in sections:
        parts += [f"## {heading}", "", "| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
        parts += ["| " + " | ".join(map(markdown, row)) + " |" for row in rows] + [""]
    items = [f"- {markdown(each)}" for each in statements]
    return "\n".join([*parts, "## What the data identify", "", *items, "", f"![the fit]({picture})", ""])


_MARKUP = re.compile(r"[\\`*{}\[\]<>#|&$~]|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9])")


def markdown(text: str) -> str:
    """A text in one line of Markdown that is shown as it is: no markup, no HTML, no formula, no cell's end."""
    return _MARKUP.sub(r"\\\g<0>", printable(" ".join(text.split())))


def _html(title: str, sections: Sequence[Section], statements: Sequence[str], picture: str) -> str:
    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(printable(cell))}</{tag}>" for cell in cells) + "</tr>"

    style = (
        "body{font:15px sans-serif;max-width:62em;margin:2em auto}"
        "table{border-collapse:collapse}svg{max-width:100%;height:auto}"
        "td,th{padding:.2em .7em;text-align:left;border-bottom:1px solid #ddd;font-variant-numeric:tabular-nums}"
    )
    name = html.escape(title)
    parts = [
        "<!DOCTYPE html>", f'<html lang="en"><head><meta charset="utf-8"><title>{name}</title>',
        f"<style>{style}</style></head><body>", f"<h1>{name}</h1>",
    ]  # fmt: skip
    for heading, head, rows, _ in sections:
        parts += [f"<h2>{heading}</h2>", "<table>", row(head, "th"), *(row(cells, "td") for cells in rows), "</table>"]
    items = [f"<li>{html.escape(printable(each))}</li>" for each in statements]
    parts += ["<h2>What the data identify</h2>", "<ul>", *items, "</ul>"]
    return "\n".join([*parts, picture[picture.index("<svg") :], "</body></html>", ""])
