"""Break the engine's C on purpose, one line at a time, and see a test fail: `python -m tests.mutation`.

Mutants are drawn by a seed (draw.py), instantiated, compiled without optimisation and with a count of basic blocks, and
run against tests in C (evaluate.py), in double precision, then in single, up to the first that fails. A mutant counts
for nothing if it does not compile, or if -O2 makes the engine's objects of it; then the next one of its line follows.
Exit code 1 if fewer than --least are killed.
"""

import argparse
import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import Queue

from derive.emit.sources import engine
from tests.conformance.firmware.targets import ROOT
from tests.mutation.draw import Mutant, drawn
from tests.mutation.evaluate import Bench, InvalidMutant

SEED, COUNT, LEAST = 20261123, 400, 0.90
PAGE = ROOT / "docs" / "developers" / "c-mutants.md"
MEASURED = "## Measured\n\n"
"""What follows in the page is written by --report."""
SELFTEST = "c/selftest_real.h"
"""Its digest is compared: any change of it is noticed."""


@dataclass(frozen=True)
class Result:
    """A mutant, and the test that killed it, in a precision; None if it survives."""

    mutant: Mutant
    killed_by: str | None


def sources(names: list[str]) -> dict[str, str]:
    """The engine's C by path, but for what notes, which no program in C asks; or those files of it that end so."""
    of_c = ((name, path) for name, path in engine() if name.startswith("c/") and not name.startswith("c/notes/"))
    found = {name: path.read_text("utf-8") for name, path in of_c if name != SELFTEST}
    return {name: text for name, text in found.items() if not names or name.endswith(tuple(names))}


def results(seed: int, count: int, texts: dict[str, str], folder: Path, jobs: int) -> Iterator[Result]:
    """One result for each of so many lines."""
    benches = [Bench(folder / "0")]
    benches += [benches[0].duplicate(folder / str(job)) for job in range(1, jobs)]
    free = Queue[Bench]()
    for bench in benches:
        free.put(bench)

    def evaluated(mutants: list[Mutant]) -> Result | None:
        bench = free.get()
        try:
            for mutant in mutants:
                try:
                    return Result(mutant, bench.killed_by(mutant.file, mutant.apply(texts[mutant.file])))
                except InvalidMutant:
                    continue
            return None
        finally:
            free.put(bench)

    lines = list(drawn(seed, texts))
    with ThreadPoolExecutor(jobs) as pool:
        while count > 0 and lines:
            some, lines = lines[:count], lines[count:]
            for result in filter(None, pool.map(evaluated, some)):
                count -= 1
                yield result


def report(found: list[Result], seed: int) -> str:
    """The measured part of the page: who killed how many, of which files, and the survivors."""
    causes = Counter(result.killed_by or "nothing: survives" for result in found)
    files = Counter(result.mutant.file for result in found)
    survivors = [result.mutant for result in found if result.killed_by is None]
    killed = len(found) - len(survivors)
    rows = [f"Seed {seed}, {len(found)} mutants: {killed} killed ({killed / max(len(found), 1):.1%}).", ""]
    rows += ["| killed by | mutants |", "| --- | --: |"]
    rows += [f"| {name} | {n} |" for name, n in causes.most_common()]
    rows += ["", "| file of `runtime/engine` | mutants | survive |", "| --- | --: | --: |"]
    rows += [f"| `{file}` | {n} | {sum(each.file == file for each in survivors)} |" for file, n in files.most_common()]
    return "\n".join([*rows, "", "Survivors:", "", "```text", *map(str, survivors), "```", ""])


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=COUNT, help=f"mutants (default: {COUNT})")
    parser.add_argument("--seed", type=int, default=SEED, help=f"of the draw (default: {SEED})")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="at a time (default: all processors)")
    parser.add_argument("--least", type=float, default=LEAST, help=f"share to be killed (default: {LEAST})")
    parser.add_argument("--report", action="store_true", help=f"write {PAGE.relative_to(ROOT)}")
    parser.add_argument("files", nargs="*", help="ends of paths in runtime/engine (default: all of its C)")
    chosen = parser.parse_args()
    began, found = time.monotonic(), list[Result]()
    with tempfile.TemporaryDirectory(prefix="hopform-mutants-") as folder:
        for result in results(chosen.seed, chosen.count, sources(chosen.files), Path(folder), chosen.jobs):
            found.append(result)
            print(f"{result.killed_by or 'SURVIVES'}: {result.mutant}", flush=True)
    text = report(found, chosen.seed)
    print(f"{text.partition('Survivors:')[0]}{time.monotonic() - began:.0f} s")
    if chosen.report:
        PAGE.write_text(PAGE.read_text("utf-8").partition(MEASURED)[0] + MEASURED + text, "utf-8")
    killed = sum(result.killed_by is not None for result in found)
    return 0 if found and killed >= chosen.least * len(found) else 1


if __name__ == "__main__":
    sys.exit(main())
