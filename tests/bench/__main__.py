"""`python -m tests.bench [--quick | --picture]`: the table, docs/evidence/benchmark.*, the README's; --quick writes into
out/ instead, --picture draws that of the page anew.
"""

import sys
from pathlib import Path

from rich.console import Console

from tests import palette
from tests.bench import beside, native, report
from tests.bench.jobs import COUNT, sets
from tests.bench.pieces import pieces
from tests.bench.timing import fixed_loop, measure

QUICK = {"count": 20, "repetitions": 3}
FULL = {"count": COUNT, "repetitions": 9}


def main() -> None:
    quick = "--quick" in sys.argv[1:]
    size = QUICK if quick else FULL
    console = Console(width=None if sys.stdout.isatty() else 150)
    progress = Console(stderr=True)
    before = fixed_loop()
    with progress.status("benchmarks") as status:
        outcome = measure(**size, report=status.update)
        status.update("instructions")
        found = {
            (of.name, precision): pieces(precision, of.first(size["count"]), size["repetitions"])
            for of in sets()
            for precision in native.REALS
        }
        status.update("beside the table")
        lines = beside.measure(size["repetitions"])
    loops = before, fixed_loop()
    report.terminal(outcome, found, lines, console, loops)
    folder = native.OUT if quick else native.ROOT / "docs" / "evidence"
    (folder / "benchmark.md").write_text(report.markdown(outcome, found, lines, loops), "utf-8")
    draw(folder)
    console.print(f"written: {folder.relative_to(native.ROOT)}/benchmark.md and .png", markup=False)


def draw(folder: Path) -> None:
    """The picture of the page that lies in a folder."""
    palette.save(report.drawn((folder / "benchmark.md").read_text("utf-8")), folder / "benchmark.png")


if __name__ == "__main__":
    draw(native.ROOT / "docs" / "evidence") if "--picture" in sys.argv[1:] else main()
