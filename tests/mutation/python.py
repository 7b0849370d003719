"""`python -m tests.mutation.python` changes the package in one random place at a time and sees a test fail each time.

cosmic-ray's operators make the changes: an arithmetic, logical or comparison operator becomes another, a condition is
negated, a number grows or shrinks by 1, a decorator goes, a loop runs zero times, an exception is another one. A place
is drawn with equal probability, then one of the changes that can be made there. The draw depends on the seed and on the
place's own line, so an edit elsewhere leaves it as it is. A module that cannot be imported any more, an annotation that
is no type for instance, counts for nothing: the next place follows. The nearest tests and the module's own doctests are
run up to the first that fails. Exit code 1 if fewer than --least fail.
"""

import argparse
import difflib
import hashlib
import os
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import Queue

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

from tests.mutation.copies import ROOT, CopyFailed, copied, killed_by, python, tests

LEAST = 0.80
"""Share of the mutants that a test must notice."""
SEED, COUNT = 20261123, 60
TIME_LIMIT = 120
"""[s] of a processor for all tests of one mutant."""

BAD, HOPS, MAPS = "tests/unit/test_bad_input.py", "tests/unit/test_hopping.py", "tests/unit/test_reachability.py"
CONTROL = ("tests/conformance/test_control.py", "tests/conformance/test_control_search.py")
DOORS = ("tests/unit/test_doors.py", "tests/unit/test_outside_functions.py")
RUNS = (
    HOPS,
    "tests/conformance/test_hops.py",
    "tests/unit/test_run_object.py",
    "tests/unit/test_hopping_properties.py",
)
MOTION = (
    "tests/conformance/test_ties.py",
    "tests/conformance/test_stance.py",
    "tests/conformance/test_checker.py",
    "tests/conformance/test_switchovers.py",
)
RECORDED = (
    "tests/unit/test_estimation.py",
    "tests/unit/test_recordings.py",
    "tests/unit/test_rigs.py",
    "tests/unit/test_identification.py",
)
NEAREST = {
    "_checks.py": (BAD, HOPS, *DOORS),
    "_robots/__init__.py": (
        BAD,
        "tests/unit/test_files.py",
        "tests/unit/test_provenance.py",
        "tests/unit/test_cli.py",
        "tests/unit/test_solvers.py",
        "tests/repository/test_statuses.py",
        *DOORS,
    ),
    "hopping/terrain.py": (HOPS, *DOORS),
    "hopping/controllers.py": (*RUNS, BAD),
    "hopping/_run.py": (*RUNS, BAD),
    "hopping/_touchdown.py": ("tests/unit/test_touchdown.py", HOPS, *DOORS),
    "_control.py": (*CONTROL, MAPS, HOPS, BAD, "tests/unit/test_cli_control.py"),
    "identify/_drop.py": RECORDED,
    "identify/_estimation.py": RECORDED,
    "identify/_fits.py": RECORDED,
    "identify/_force.py": RECORDED,
    "identify/_held.py": RECORDED,
    "identify/_kinds.py": RECORDED,
    "identify/_motion.py": RECORDED,
    "identify/_recordings.py": RECORDED,
    "identify/_rigs.py": RECORDED,
    "identify/_search.py": RECORDED,
    "identify/_segments.py": RECORDED,
    "hopform_solver/kernels.py": ("tests/conformance/test_closed_form.py", "tests/unit/test_formulas.py"),
    "hopform_solver/solver.py": ("tests/conformance/test_readable_solver.py", "tests/conformance/test_closed_form.py"),
}
"""Modules that are changed, in runtime/hopform or the generated package, with the tests that are about them."""
QUICK = tuple(
    module for module, files in NEAREST.items() if files is not RECORDED and not module.startswith("hopform_solver/")
)
"""Modules whose tests take seconds; a mutant of identification that survives takes a minute.
"""


def path_of(module: str) -> str:
    """The file of a module in the repository: the engine's NumPy is changed where Python finds it."""
    return f"generated/python/{module}" if module.startswith("hopform_solver/") else f"runtime/hopform/{module}"


@dataclass(frozen=True)
class Mutant:
    """A change of one place: an operator of cosmic-ray, and which of its places in the module."""

    module: str
    line: int
    operator: str
    occurrence: int

    @property
    def path(self) -> str:
        return path_of(self.module)

    def code(self) -> str:
        changed = mutate_code((ROOT / self.path).read_text("utf-8"), get_operator(self.operator)(), self.occurrence)
        assert changed is not None, self
        return changed

    def difference(self) -> str:
        old = (ROOT / self.path).read_text("utf-8").splitlines()
        lines = [
            line
            for line in difflib.unified_diff(old, self.code().splitlines(), n=0, lineterm="")
            if line[0] in "+-" and line[:3] not in {"+++", "---"}
        ]
        return f"{self.module}:{self.line}: {self.operator.removeprefix('core/')}\n    " + "\n    ".join(lines)


def drawn(seed: int, modules: tuple[str, ...] = QUICK) -> list[Mutant]:
    """One mutant of each place, in the order of the draw."""
    operators = [(name, get_operator(name)) for name in sorted(operator_names())]
    order = list[tuple[bytes, Mutant]]()
    for module in modules:
        code = (ROOT / path_of(module)).read_text("utf-8")
        nodes, lines = list(ast_nodes(get_ast(code))), code.splitlines()
        places = dict[tuple[int, int], list[Mutant]]()
        for name, operator in operators:
            if operator.arguments():
                continue
            found = (start for node in nodes for start, _ in operator().mutation_positions(node))
            for occurrence, (line, column) in enumerate(found):
                places.setdefault((line, column), []).append(Mutant(module, line, name, occurrence))
        seen = Counter[str]()
        for (line, column), choices in places.items():
            text = f"{seed} {module} {lines[line - 1]} {column}"
            seen[text] += 1
            key = hashlib.sha256(f"{text} {seen[text]}".encode()).digest()
            order.append((key, random.Random(key).choice(choices)))
    return [mutant for _, mutant in sorted(order, key=lambda each: each[0])]


def outcomes(mutants: list[Mutant], count: int, trees: list[Path]) -> Iterator[tuple[Mutant, str | None]]:
    """The first so many mutants that can be imported, each with the test that killed it."""
    free = Queue[Path]()
    for tree in trees:
        free.put(tree)

    def tried(mutant: Mutant) -> tuple[Mutant, str | None] | None:
        tree = free.get()
        try:
            (tree / mutant.path).write_text(mutant.code(), "utf-8")
            name = (
                mutant.path.removeprefix("runtime/")
                .removeprefix("generated/python/")
                .removesuffix(".py")
                .removesuffix("/__init__")
                .replace("/", ".")
            )
            if python(tree, "-c", f"import hopform, {name}", limit=TIME_LIMIT).returncode != 0:
                return None
            return mutant, killed_by(tests(tree, (mutant.path, *NEAREST[mutant.module]), TIME_LIMIT))
        finally:
            (tree / mutant.path).write_bytes((ROOT / mutant.path).read_bytes())
            free.put(tree)

    done, ahead = 0, 0
    with ThreadPoolExecutor(max_workers=len(trees)) as pool:
        while done < count and ahead < len(mutants):
            some = mutants[ahead : ahead + min(count - done, 4 * len(trees))]
            ahead += len(some)
            for outcome in pool.map(tried, some):
                if outcome is not None:
                    done += 1
                    yield outcome


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutation.python", description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=COUNT, help=f"mutants (default: {COUNT})")
    parser.add_argument("--least", type=float, default=LEAST, help=f"share to be killed (default: {LEAST})")
    parser.add_argument("--seed", type=int, default=SEED, help=f"of the draw (default: {SEED})")
    parser.add_argument(
        "modules",
        nargs="*",
        help=f"modules, as {QUICK[0]} or hopform_solver/solver.py (default: those with quick tests)",
    )
    chosen = parser.parse_args()
    modules = tuple(chosen.modules) or QUICK
    if unknown := set(modules) - set(NEAREST):
        parser.error(f"no tests are known for {', '.join(sorted(unknown))}; known: {', '.join(NEAREST)}")
    began = time.monotonic()
    made, killed, survivors = Counter[str](), Counter[str](), list[Mutant]()
    with tempfile.TemporaryDirectory(prefix="hopform-mutants-") as folder:
        trees = [copied(Path(folder, str(n))) for n in range(os.cpu_count() or 1)]
        needed = tuple(dict.fromkeys(file for module in modules for file in NEAREST[module]))
        if (red := killed_by(tests(trees[0], needed, 10 * TIME_LIMIT))) is not None:
            raise CopyFailed(f"the copy is red before anything is changed: {red}")
        for mutant, test in outcomes(drawn(chosen.seed, modules), chosen.count, trees):
            made[mutant.module] += 1
            if test is None:
                survivors.append(mutant)
                print(f"SURVIVED {mutant.difference()}", flush=True)
            else:
                killed[mutant.module] += 1
                print(f"{mutant.module}:{mutant.line} {mutant.operator.removeprefix('core/')}: {test}", flush=True)
    print("\n| module | mutants | killed |\n| --- | --: | --: |")
    for module in modules:
        print(f"| `{module}` | {made[module]} | {killed[module]} |")
    share = killed.total() / max(made.total(), 1)
    seconds = time.monotonic() - began
    print(f"\n{made.total()} mutants, {killed.total()} killed ({share:.1%}), seed {chosen.seed}, {seconds:.0f} s")
    return 0 if made.total() and share >= chosen.least else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except CopyFailed as error:
        sys.exit(f"hopform: {error}")
