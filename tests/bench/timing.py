"""Time every row in one run: the repetitions of all rows interleaved, the median of each kept.

Everything runs on one thread and is timed by the processor's time, so what else the machine does counts little. Rows
that take long have three repetitions.

What has been timed is kept in out/benchmarks as it comes in, so a run that was stopped goes on where it was.
"""

import hashlib
import json
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.bench import truth
from tests.bench.jobs import Jobs, sets
from tests.bench.native import OUT, C, NotBuilt, versions
from tests.bench.rows import Ready, Row, every_row
from tests.bench.verdicts import Verdict, assess
from tests.oracle import integrator, rules

LOOP, AGREE = 2_000_000, 0.1
"""Turns of the fixed loop, and the share within which its times before and after must agree for times to be shown: a
neighbour takes the processor's cache and clock, which the processor's time does not know. Ratios of one run stay."""
SHORTEST, LONG, FEW = 0.02, 0.2, 3
"""[s] a repetition solves its jobs over and over for as long as SHORTEST; where it takes LONG, FEW are enough."""


def fixed_loop() -> float:
    """[s] that the same work takes, the median of 5."""
    taken = list[float]()
    for _ in range(5):
        begin, total = time.process_time(), 0
        for n in range(LOOP):
            total += n & 7
        taken.append(time.process_time() - begin)
    return statistics.median(taken)


def agree(loops: tuple[float, float]) -> bool:
    """Whether the fixed loop took as long before and after a run."""
    return max(loops) <= (1.0 + AGREE) * min(loops)


@dataclass(frozen=True)
class Result:
    """A row, measured: per set the median time of a stance [us] and the verdict."""

    row: Row
    times: dict[str, float]
    verdicts: dict[str, Verdict]

    @property
    def wrong(self) -> int:
        return sum(verdict.wrong for verdict in self.verdicts.values())


@dataclass(frozen=True)
class Outcome:
    """All rows, what was left out and why, one line each, and over what."""

    results: tuple[Result, ...]
    left_out: tuple[str, ...]
    count: int
    repetitions: int


@dataclass
class _Entry:
    row: Row
    jobs: Jobs
    ready: Ready
    loops: int
    few: bool
    verdict: Verdict

    @property
    def key(self) -> str:
        return f"{self.row.name} | {self.jobs.name}"

    def time(self) -> float:
        """Microseconds per stance, once."""
        begin = time.process_time()
        self.ready.run(self.loops)
        return (time.process_time() - begin) / (self.loops * self.ready.stances) * 1e6


def _entry(row: Row, jobs: Jobs, exact: list[dict[str, Any]]) -> _Entry:
    """A row made ready, judged, and timed once to see how often it fits into a repetition."""
    ready = row.ready(jobs)
    ready.run(1)  # compilers, caches
    begin = time.process_time()
    verdict_on = ready.run(1)
    took = time.process_time() - begin
    loops = max(1, round(SHORTEST / max(took, 1e-6)))
    return _Entry(row, jobs, ready, loops, took > LONG, assess(jobs, ready.answers(verdict_on), exact))


def _entries(jobs: tuple[Jobs, ...], report: Callable[[str], None]) -> tuple[list[_Entry], list[str]]:
    exact, entries, left_out = truth.load(), list[_Entry](), list[str]()
    for row in every_row():
        report(row.name)
        try:
            entries += [_entry(row, of, exact[of.name]) for of in jobs]
        except (NotBuilt, ImportError, OSError, TypeError, ValueError) as error:
            left_out.append(f"{row.name}: {str(error).splitlines()[0]}")
    return entries, left_out


def _stamp(jobs: tuple[Jobs, ...]) -> str:
    """What the times belong to: these benchmarks, this C, these jobs, this compiler."""
    shared = (integrator.__file__, rules.__file__)
    files = [*sorted(Path(__file__).parent.rglob("*.[pch]*")), *map(Path, shared), *sorted(C.rglob("*.[ch]"))]
    texts = [path.read_bytes() for path in files if path.is_file() and "__pycache__" not in path.parts]
    parts = [*texts, versions().encode(), *(of.table.tobytes() for of in jobs)]
    return hashlib.sha256(b"".join(parts)).hexdigest()[:16]


def measure(count: int, repetitions: int, report: Callable[[str], None]) -> Outcome:
    """Every row on the first `count` stances of each set."""
    jobs = tuple(of.first(count) for of in sets())
    entries, left_out = _entries(jobs, report)
    kept = OUT / f"times-{_stamp(jobs)}.json"
    times: dict[str, list[float]] = json.loads(kept.read_text("utf-8")) if kept.exists() else {}
    for repetition in range(repetitions):
        for entry in entries:
            of = times.setdefault(entry.key, [])
            if len(of) <= repetition and not (entry.few and repetition >= FEW):
                report(f"repetition {repetition + 1} of {repetitions}: {entry.row.name}")
                of.append(entry.time())
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(times), "utf-8")
    kept.unlink()  # the next run measures anew
    results = [_result(row, entries, times) for row in dict.fromkeys(entry.row for entry in entries)]
    return Outcome(tuple(results), tuple(left_out), count, repetitions)


def _result(row: Row, entries: list[_Entry], times: dict[str, list[float]]) -> Result:
    of = [entry for entry in entries if entry.row is row]
    medians = {entry.jobs.name: statistics.median(times[entry.key]) for entry in of}
    return Result(row, medians, {entry.jobs.name: entry.verdict for entry in of})
