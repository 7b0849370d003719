"""What came out: a table for the terminal, the same in Markdown, and the work-precision picture."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from tests.bench.beside import Line
from tests.bench.native import versions, versions_of_peers
from tests.bench.pieces import Piece
from tests.bench.rows import BASE
from tests.bench.timing import Outcome, Result, agree

SETS = ("hopper_c", "random")
ACCURATE = 1e-9
Pieces = Mapping[tuple[str, str], tuple[Piece, ...]]


def base(outcome: Outcome) -> Result:
    """The row that is 1."""
    return next(result for result in outcome.results if result.row.name == BASE)


def largest_error(result: Result) -> float:
    """The largest error of a row over both sets."""
    return max(verdict.error for verdict in result.verdicts.values())


def fastest_right(outcome: Outcome, error: float = math.inf) -> Result | None:
    """The fastest peer, over both sets, without a wrong event list in either and with errors up to `error`."""
    right = [
        result
        for result in outcome.results
        if not result.row.is_ours and result.wrong == 0 and largest_error(result) <= error
    ]
    return min(right, key=lambda result: sum(result.times.values()), default=None)


def titles(*, times: bool) -> tuple[str, ...]:
    """The head of the table."""
    of_each = (*(("us/stance",) if times else ()), "ratio", "error", "wrong")
    return ("solver", *(f"{of} {what}" for of in SETS for what in of_each))


def cells(result: Result, one: Result, *, times: bool) -> tuple[str, ...]:
    """A line of the table."""
    found = [result.row.name]
    for of in SETS:
        verdict, ratio = result.verdicts[of], result.times[of] / one.times[of]
        found += [_short(result.times[of])] if times else []
        found += [_short(ratio), f"{verdict.error:.0e}", str(verdict.wrong)]
    return tuple(found)


def _short(value: float) -> str:
    return f"{value:.2f}" if value < 10.0 else (f"{value:.1f}" if value < 100.0 else f"{value:.0f}")


def against(outcome: Outcome, best: Result, one: Result) -> str:
    """A peer in a sentence: its error and how much longer it takes."""
    included = next(result for result in outcome.results if result.row.name == f"{BASE}, plan included")
    ratios = " and ".join(f"{_short(best.times[of] / one.times[of])} x on {of}" for of in SETS)
    with_plan = " and ".join(f"{_short(best.times[of] / included.times[of])} x" for of in SETS)
    return (
        f"{best.row.name}, largest error {largest_error(best):.0e}: it takes {ratios} the time of {BASE} "
        f"(largest error {largest_error(one):.0e}), {with_plan} where hopform's plan is made anew for each stance."
    )


def headline(outcome: Outcome) -> str:
    """hopform's C against the fastest peer that is right, and against the fastest that is also accurate."""
    best, one, accurate = fastest_right(outcome), base(outcome), fastest_right(outcome, ACCURATE)
    if best is None:
        return "No peer was without a wrong event list."
    text = f"The fastest peer without a wrong event list is {against(outcome, best, one)}"
    if accurate is None:
        return f"{text} None of them has errors up to {ACCURATE:.0e}."
    if accurate is best:
        return text
    return f"{text} The fastest of those with errors up to {ACCURATE:.0e} is {against(outcome, accurate, one)}"


def said_of(loops: tuple[float, float]) -> str:
    """Whether the machine was alone, in a sentence."""
    before, after = (f"{1e3 * each:.3g} ms" for each in loops)
    found = f"A fixed loop took {before} before and {after} after the run"
    return f"{found}." if agree(loops) else f"{found}: the machine was not alone, so no times are shown."


def terminal(
    outcome: Outcome, pieces: Pieces, lines: Sequence[Line], console: Console, loops: tuple[float, float]
) -> None:
    """Print everything."""
    times = agree(loops)
    table = Table(title=f"{outcome.count} stances of each set, median of {outcome.repetitions} repetitions")
    for n, title in enumerate(titles(times=times)):
        table.add_column(title, justify="right" if n else "left", no_wrap=n == 0)
    for result in outcome.results:
        table.add_row(*cells(result, base(outcome), times=times), style=None if result.wrong == 0 else "dim")
    console.print(table)
    for line in outcome.left_out:
        console.print(f"left out: {line}", markup=False)
    alone = Table("hopform C alone", *piece_titles(times=times), title="per call")
    for row in piece_cells(pieces, times=times):
        alone.add_row(*row)
    console.print(alone)
    besides = Table(*LINE_TITLES, title="beside the table")
    for cells_of in line_cells(lines, times=times):
        besides.add_row(*cells_of)
    console.print(besides)
    console.print(headline(outcome), markup=False)
    console.print(said_of(loops), markup=False)


def piece_titles(*, times: bool) -> tuple[str, ...]:
    return ("jobs", "precision", "instructions", *(("ns",) if times else ()))


def piece_cells(pieces: Pieces, *, times: bool) -> list[tuple[str, ...]]:
    return [
        (
            piece.function,
            of,
            precision,
            "-" if piece.instructions is None else f"{piece.instructions:.0f}",
            *((f"{piece.nanoseconds:.0f}",) if times else ()),
        )
        for (of, precision), found in pieces.items()
        for piece in found
    ]


LINE_TITLES = ("what", "value", "unit", "ratio")


def line_cells(lines: Sequence[Line], *, times: bool) -> list[tuple[str, ...]]:
    shown = [line for line in lines if times or not _is_time(line) or line.ratio is not None]
    return [
        (
            line.name,
            _short(line.value) if times or not _is_time(line) else "-",
            line.unit,
            "" if line.ratio is None else _short(line.ratio),
        )
        for line in shown
    ]


def _is_time(line: Line) -> bool:
    return line.unit.startswith(("us", "ns"))


def _markdown(titles: tuple[str, ...], rows: list[tuple[str, ...]], texts: int) -> str:
    """A Markdown table; the columns behind the first `texts` hold numbers."""
    rule = ["---" if n < texts else "--:" for n in range(len(titles))]
    return "\n".join("| " + " | ".join(line) + " |" for line in (titles, tuple(rule), *rows)) + "\n"


def markdown(outcome: Outcome, pieces: Pieces, lines: Sequence[Line], loops: tuple[float, float]) -> str:
    """The page docs/evidence/benchmark.md; with times where a fixed loop took as long before and after the run."""
    one, times = base(outcome), agree(loops)
    left_out = "".join(f"\nLeft out: {line}.\n" for line in outcome.left_out)
    return f"""# Benchmarks

`make bench` makes this page and its picture: {outcome.count} stances of each set, one thread,
processor time, all rows in one run, repetitions interleaved, the median of {outcome.repetitions} (3 for slow rows).
hopform is compiled with the flags it ships with (-O2, portable baseline), the peers with -O3 -march=native. All by
{versions()}; {versions_of_peers()}.

{said_of(loops)}

{headline(outcome)}

![Work and precision](benchmark.png)

The job: touchdown state and a constant current in; take-off time and state, every event with its time, and the AED
(analytical energy delta) out,
by the same rules for sticking, slipping, reversals and stops.

- `hopper_c`: drops from 2 to 40 cm at -3 to 3 A. `random`: a robot of its own for each stance, mass ratio 1e-2 to 1e2,
  k 1e2 to 1e5 N/m, Coulomb friction, a third with stops.
- ratio: time over that of {BASE}. The plan of a robot is made once, unless a row says otherwise. `solve_stance` is
  the call alone: a stance unfolds its events when they are asked for.
- error: the largest scaled error of times, state and AED against the 50-digit reference, over the condition number
  where that is above 1.
- wrong: stances whose ending or event list is not the reference's; they are not in the error.
- Every peer starts anew at every switch, with a first step within which no event function that starts at zero returns.
  For expm + brentq the tolerance sets how densely it scans.

{_markdown(titles(times=times), [cells(result, one, times=times) for result in outcome.results], 1)}{left_out}
## hopform's C alone

Instructions are counted by callgrind, so they are the same on a busy machine; per call, on the same stances.

{_markdown(("function", *piece_titles(times=times)), piece_cells(pieces, times=times), 3)}
## Beside the table

The paper's sequence, both masses moving, the body turning once, then take-off, has a closed form that one can write by
hand; it proves nothing and knows no other event. Many stances: ratios are to the C loop over the same stances, which
has the plans ready; where every stance has its own robot `solve_stances` makes them too. The memory is that of a
process of its own, without event lists.

{_markdown(LINE_TITLES, line_cells(lines, times=times), 1)}"""


COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F7F7F", "#882255", "#999933")
MARKS = "*PDXv^<>"


def table_of(page: str) -> list[dict[str, str]]:
    """The rows of the page's table of solvers, by the titles of its columns."""
    table = page[page.index("| solver |") :].partition("\n\n")[0]
    head, _, *lines = ([cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines())
    return [dict(zip(head, line, strict=True)) for line in lines]


def drawn(page: str) -> Any:
    """Ratio over error of every row of the page's table, a line per peer; hollow where an event list is wrong."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 4.8), dpi=100, layout="constrained")
    table = table_of(page)
    solvers = list(dict.fromkeys(row["solver"].partition(", rtol")[0] for row in table))
    marks, colours = iter(MARKS), iter(COLOURS)
    styles: dict[str, dict[str, Any]] = {
        name: {"color": "black", "marker": next(marks), "linestyle": ""} if name.startswith("hopform")
        else {"color": next(colours), "marker": "o", "linewidth": 1.2}
        for name in solvers
    }  # fmt: skip
    for of, ax in zip(SETS, figure.subplots(1, 2, sharey=True), strict=True):
        for name, style in styles.items():
            rows = [row for row in table if row["solver"].partition(", rtol")[0] == name]
            errors = [max(float(row[f"{of} error"]), 1e-17) for row in rows]
            ratios = [float(row[f"{of} ratio"]) for row in rows]
            ax.plot(errors, ratios, label=name, markersize=6, **style)
            wrong = [n for n, row in enumerate(rows) if row[f"{of} wrong"] != "0"]
            ax.plot([errors[n] for n in wrong], [ratios[n] for n in wrong], "o", color="white", markersize=3)
        ax.set(xscale="log", yscale="log", xlabel="largest scaled error", title=of)
        ax.grid(alpha=0.3)
    first = figure.axes[0]
    first.set_ylabel(f"time of a stance over that of {BASE}")
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", fontsize=8, title="hollow: wrong event lists")
    return figure
