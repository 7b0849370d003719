"""How often intervals contain the truth, by two generators, as a table of docs/evidence/identification.md.

The first generator (`tests.conformance.faults`) is the one on which the search of a fit was tuned. The second one
(`tests.conformance.blind`) draws other rigs, rates, currents and noises, and effects that no element has; the numbers
of its rigs here are not those that anybody looked at while the causes were written (`FIRST_BLIND`).

`python -m tests.conformance.evidence` (`make evidence-identification`) writes the table, with the interval of Wilson of
each share, and which rows do not hold.
"""

import argparse
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tests.conformance import blind, faults

PAGE = Path(__file__).resolve().parents[2] / "docs" / "evidence" / "identification.md"
BEGIN, END = "<!-- python -m tests.conformance.evidence -->", "<!-- the end of it -->"
FIRST_BLIND = 1000
"""Number of the first rig of the second generator."""
HOLDS = 0.9
"""Share of the intervals of a row that must contain the truth."""
COUNTS = {"first": 4, "second": 9}
"""Rigs of a row: some six minutes of processor time together."""


@dataclass(frozen=True)
class Row:
    """A kind of recording with a fault, by a generator: fits, those without an interval, intervals and how many of them
    contain the truth, fits that are gross and silent, what is named first and how often, how often that is not there,
    recordings that were refused.
    """

    generator: str
    kind: str
    fault: str
    fits: int
    without: int
    intervals: int
    inside: int
    gross: int
    names: Mapping[str, int]
    wrong: int
    refused: int

    @property
    def misses(self) -> bool:
        """Whether fewer intervals than must be contain the truth."""
        return self.intervals > 0 and self.inside < HOLDS * self.intervals


def wilson(hits: int, count: int, z: float = 1.959964) -> tuple[float, float]:
    """The 95 % interval of a share (E. B. Wilson, 1927): where |hits/count - p| <= z sqrt(p (1 - p)/count)."""
    share, more = hits / count, z * z / count
    middle, half = share + 0.5 * more, math.sqrt(share * (1.0 - share) * more + 0.25 * more * more)
    return max((middle - half) / (1.0 + more), 0.0), min((middle + half) / (1.0 + more), 1.0)


def first(kind: str, name: str, count: int) -> Row:
    """A cell of the first generator."""
    cell = faults.measure(faults.SEED, count, {kind: (name,)})[kind, name]
    return Row("first", kind, name, cell.fits, cell.without, cell.total, cell.inside, cell.gross, cell.names,
               cell.wrong(name), len(cell.failed))  # fmt: skip


def second(kind: str, name: str, count: int) -> Row:
    """A cell of the second generator."""
    cell = blind.measure(kind, name, range(FIRST_BLIND, FIRST_BLIND + count), compare=False, holdout=False)
    return Row("second", kind, name, cell.fits, cell.without, cell.total, cell.inside, len(cell.gross), cell.names,
               cell.wrong(name), len(cell.failed))  # fmt: skip


def share(hits: int, count: int) -> str:
    """A share with its interval, in percent; "-" of none."""
    if count == 0:
        return "-"
    low, high = (100.0 * end for end in wilson(hits, count))
    return f"{hits} of {count}: {100.0 * hits / count:.0f} % ({low:.0f} to {high:.0f})"


def table(rows: Sequence[Row]) -> Iterator[str]:
    """The table of a page, a row for each cell, and the sums of each generator."""
    yield (
        "| generator | recording | fault | fits | refused | without an interval | intervals that contain the truth "
        "| gross and silent | named | of these wrong |"
    )
    yield "| --- | --- | --- | --: | --: | --: | --- | --- | --- | --- |"
    for row in rows:
        named = ", ".join(f"{name} {count}" for name, count in row.names.items() if name != "-") or "nothing"
        numbers = f"{row.fits} | {row.refused} | {row.without} | {share(row.inside, row.intervals)} | {row.gross}"
        yield f"| {row.generator} | {row.kind} | {row.fault} | {numbers} | {named} | {row.wrong} |"
    for generator in dict.fromkeys(row.generator for row in rows):
        some = [row for row in rows if row.generator == generator]
        fits, refused, without, intervals, inside, gross, wrong = (
            sum(getattr(row, name) for row in some)
            for name in ("fits", "refused", "without", "intervals", "inside", "gross", "wrong")
        )
        named = sum(count for row in some for name, count in row.names.items() if name != "-")
        numbers = f"{fits} | {refused} | {without} | {share(inside, intervals)} | {share(gross, fits)}"
        yield f"| {generator} | all | | {numbers} | {named} | {share(wrong, named)} |"


def misses(rows: Sequence[Row]) -> Iterator[str]:
    """Sentences about the rows that do not hold."""
    some = [row for row in rows if row.misses]
    if not some:
        yield f"In every row at least {100.0 * HOLDS:.0f} % of the intervals contain the truth."
        return
    yield f"These rows do not hold: in them fewer than {100.0 * HOLDS:.0f} % of the intervals contain the truth."
    yield ""
    for row in some:
        even = wilson(row.inside, row.intervals)[1] >= HOLDS
        doubt = f"; {100.0 * HOLDS:.0f} % is within the interval of this share" if even else ""
        yield f"- {row.kind}, {row.fault} ({row.generator} generator): {share(row.inside, row.intervals)}{doubt}"


def written(rows: Sequence[Row], counts: Mapping[str, int]) -> str:
    """The part of the page."""
    some = " and ".join(f"{count} of the {name}" for name, count in counts.items())
    about = (
        f"Rigs of each row: {some}. A share has its 95 % interval by Wilson, which takes intervals as independent; "
        "those of one fit miss together, so it is somewhat too narrow."
    )
    return "\n".join([BEGIN, "", about, "", *table(rows), "", *misses(rows), "", END])


def put(text: str, part: str) -> str:
    """A page with its part replaced; ValueError for a page that has none."""
    begin, end = text.index(BEGIN), text.index(END) + len(END)
    return text[:begin] + part + text[end:]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    for name, count in COUNTS.items():
        parser.add_argument(f"--{name}", type=int, default=count, help="rigs of a row")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    chosen = vars(parser.parse_args())
    cells = [(first, faults.CELLS, chosen["first"]), (second, blind.CELLS, chosen["second"])]
    with ProcessPoolExecutor(chosen.pop("jobs")) as pool:
        tasks = [pool.submit(row, kind, name, count)
                 for row, some, count in cells for kind, names in some.items() for name in names]  # fmt: skip
        rows = [each.result() for each in tasks]
    PAGE.write_text(put(PAGE.read_text("utf-8"), written(rows, chosen)), "utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
