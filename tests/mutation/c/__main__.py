"""`python -m tests.mutation.c` breaks the generated C in one place at a time, at random, and sees a test fail each
time.

The sources for firmware in double precision are broken, whose tests are the sharper ones; single precision comes from
the same templates. Mutants that do not compile are drawn again. The judges, in this order: answers.c (vectors of the
reference with their tolerances, and what must be true of any answer), parts.c (each function of the headers by itself),
inside_flight.c and inside_control.c (the inner functions of these two), refusals, contract (pointers), garbage and
fuzzing targets on fixed inputs; the digest of all bits of random stances, flights and commands
(tests/conformance/firmware/digests.c), which any changed bit changes, so what it alone kills is counted apart;
answers.c and parts.c again under the sanitizers; and the work that answers.c's calls take, in basic blocks. With
`--pytest` the nearest tests of pytest follow. Survivors are argued in docs/evidence/c-mutants.md: those that are listed
there as equivalent are taken off, the others fail.
"""

import argparse
import math
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from queue import Queue

from tests.conformance.firmware.targets import BOARDS, COMMON, HERE, ROOT, UNITS, C, Failed
from tests.conformance.firmware.targets import run as patient_run
from tests.mutation.c.operators import Mutant, mutants_of

SRC = C / "src"
MINE = Path(__file__).resolve().parent
FUZZ = ROOT / "tests" / "fuzz"
PAGE = ROOT / "docs" / "evidence" / "c-mutants.md"
BROKEN = tuple(unit for unit in UNITS if unit != "selftest")
LEAST = 0.90
MOST_EQUIVALENT = 0.05
INPUTS = "1500"
SANITIZERS = ("-fsanitize=address,undefined,float-cast-overflow,float-divide-by-zero", "-fno-sanitize-recover=all")
COUNTS = ("-fsanitize-coverage=trace-pc",)
GROWTH = 1.02
"""What calls of one kind may take together, as tests/conformance/firmware/costs.py says of instructions;
one call may take MORE and SOME.
"""
MORE, SOME = 1.1, 50

PROGRAMS = {
    "answers": (MINE / "answers.c",),
    "parts": (MINE / "parts.c",),
    "inside_flight": (MINE / "inside_flight.c",),
    "inside_control": (MINE / "inside_control.c",),
    "refusals": (HERE / "refusals.c", BOARDS / "board.c"),
    "contract": (HERE / "contract.c", BOARDS / "board.c"),
    "garbage": (HERE / "garbage.c", BOARDS / "board.c"),
    "fuzz_entry": (FUZZ / "fuzz_entry.c", FUZZ / "replay.c"),
    "fuzz_flight": (FUZZ / "fuzz_flight.c", FUZZ / "replay.c"),
    "fuzz_control": (FUZZ / "fuzz_control.c", FUZZ / "replay.c"),
    "digest": (HERE / "digests.c", BOARDS / "board.c"),
}
JUDGES = ("answers", "parts")
"""Those that the sanitizers look at again."""

NEAREST = {
    "flight": ("flight",), "control": ("control",), "trial": ("control",), "grid": ("grid",),
    "extrema": ("control", "compression"),
    "touchdown": ("touchdown",), "sensitivity": ("sensitivities", "tangents"),
    "linear": ("sensitivities", "stance_object"), "states": ("stance_object",), "energy": ("stance_object",),
    "ledger": ("stance_object", "stance"),
}  # fmt: skip
USUAL = ("ties", "false_root", "stance", "switchovers")


@cache
def text_of(name: str) -> str:
    return (SRC / name).read_text("utf-8")


def taken_in(text: str) -> frozenset[str]:
    """The files of src that a text includes, with those that they include."""
    found = {name for name in re.findall(r'#include "(\w+\.[ch])"', text) if (SRC / name).is_file()}
    return frozenset(found).union(*(includes(name) for name in found))


@cache
def includes(name: str) -> frozenset[str]:
    """The headers of src that a file takes in, itself among them."""
    return taken_in(text_of(name)) | {name}


@cache
def sources_in(program: str) -> frozenset[str]:
    """The files of src that a program takes in: headers, and the unit whose inner functions it judges."""
    text = PROGRAMS[program][0].read_text("utf-8")
    shared = (MINE / "checks.h").read_text("utf-8") if '"checks.h"' in text else ""
    return taken_in(text + shared)


def pool_of_mutants() -> list[Mutant]:
    units = [f"{unit}_f64.c" for unit in BROKEN]
    headers = sorted({header for unit in units for header in includes(unit)} - set(units))
    return [mutant for name in (*units, *headers) for mutant in mutants_of(name, text_of(name))]


def compiler() -> list[str]:
    """tcc where it is installed, which takes a tenth of the time; else cc without optimisation."""
    return ["tcc", "-w"] if shutil.which("tcc") else ["cc", "-w", "-O0"]


def run(command: list[str], timeout: float) -> tuple[int, str]:
    """The exit code, 124 if it took too much of the processor's time, and what was output."""
    try:
        return 0, patient_run(command, timeout)
    except Failed as error:
        return error.code, str(error)


CHECKED = ("gcc", "-w", "-O0", *SANITIZERS)


def takes_longer(calls: tuple[tuple[str, int], ...], usual: tuple[tuple[str, int], ...]) -> bool:
    """Whether calls of a kind take more than GROWTH of what they took, or one of them more than MORE.

    A judge that takes another way, with other calls, says nothing about either.
    """
    if [kind for kind, _ in calls] != [kind for kind, _ in usual]:
        return False
    now, before = Counter[str](), Counter[str]()
    for (kind, count), (_, least) in zip(calls, usual, strict=True):
        if count > MORE * least + SOME:
            return True
        now[kind] += count
        before[kind] += least
    return any(now[kind] > GROWTH * before[kind] for kind in before)


class Bench:
    """A folder with the sources as links, one of them broken at a time, and what was made of the others."""

    def __init__(self, folder: Path, asks_pytest: bool) -> None:
        self.folder, self.src, self.asks_pytest = folder, folder / "src", asks_pytest
        self.src.mkdir()
        for path in SRC.iterdir():
            (self.src / path.name).symlink_to(path)
        self.include = ["-I", str(C / "include"), "-I", str(self.src), "-I", str(BOARDS)]
        self.units = [f"{unit}_f64.c" for unit in UNITS] + ["version.c"]
        for unit in self.units:
            self.compile(self.src / unit, folder / f"{unit}.o")
        for name, sources in PROGRAMS.items():
            for source in sources:
                self.compile(source, folder / f"{name}-{source.name}.o")
        for unit in self.units:
            self.compile(self.src / unit, folder / f"checked-{unit}.o", CHECKED + COUNTS)
        for name in JUDGES:
            self.compile(PROGRAMS[name][0], folder / f"checked-{name}.o", CHECKED)
        self.usual_work: tuple[tuple[str, int], ...] = ()

    def twin(self, folder: Path) -> "Bench":
        """Another one beside it, without compiling all that again."""
        shutil.copytree(self.folder, folder, symlinks=True)
        other = copy(self)
        other.folder, other.src = folder, folder / "src"
        other.include = ["-I", str(C / "include"), "-I", str(other.src), "-I", str(BOARDS)]
        return other

    def compile(self, source: Path, target: Path, with_this: tuple[str, ...] = ()) -> None:
        flags = [
            "-std=c99",
            "-D_GNU_SOURCE",
            "-DDOUBLE",
            "-DENTRY=4",
            "-DDOUBLE_ALONE",
            "-DDIGEST_ROBOTS=2500",
            "-DDIGEST_COMMANDS=500",
            "-DDIGEST_SAMPLES=4500",
        ]
        command = [*(with_this or compiler()), *flags, *self.include, "-c", str(source), "-o", str(target)]
        code, output = run(command, 60)
        if code:
            raise ValueError(output)

    def is_c(self, unit: str) -> bool:
        """Whether a strict compiler takes it: swapped arguments of other types are no mutant."""
        strict = ["-Werror=incompatible-pointer-types", "-Werror=int-conversion", "-Werror=discarded-qualifiers"]
        return run(["gcc", "-std=c99", *strict, "-fsyntax-only", *self.include, str(self.src / unit)], 60)[0] == 0

    def judge(self, objects: dict[str, Path], wanted: str) -> str | None:
        """The program that fails, None if none does."""
        for name, sources in PROGRAMS.items():
            own = [self.folder / f"{name}-{source.name}.o" for source in sources]
            own = [objects.get(path.name, path) for path in own]
            units = [unit for unit in self.units if unit not in sources_in(name)]
            library = [objects.get(unit, self.folder / f"{unit}.o") for unit in units]
            image = self.folder / name
            if run([*compiler(), *map(str, [*own, *library]), "-o", str(image), "-lm"], 60)[0]:
                return "link"
            arguments = [INPUTS, *map(str, sorted((FUZZ / "found").iterdir()))] if name.startswith("fuzz") else []
            code, output = run([str(image), *arguments], 15)
            if code or (name == "digest" and output.strip() != wanted):
                return name
        return self.checked(objects)

    def checked(self, broken: dict[str, Path]) -> str | None:
        """`sanitizers` if they stop a judge, `work` if its calls take more than they did; None if neither."""
        for unit in broken:
            if unit in self.units:
                self.compile(self.src / unit, self.folder / f"broken-checked-{unit}.o", CHECKED + COUNTS)
        is_header = any(name.startswith(("answers-", "parts-")) for name in broken)
        library = [self.folder / f"{'broken-' if unit in broken else ''}checked-{unit}.o" for unit in self.units]
        for name in JUDGES if is_header else JUDGES[:1]:
            own = self.folder / f"checked-{name}.o"
            if is_header:
                own = self.folder / f"broken-checked-{name}.o"
                self.compile(PROGRAMS[name][0], own, CHECKED)
            image = self.folder / f"checked-{name}"
            if run([*CHECKED, *map(str, [own, *library]), "-o", str(image), "-lm"], 60)[0]:
                return "link"
            code, output = run([str(image), "work"], 120)
            if code:
                return "sanitizers"
            if name == "answers":
                calls = tuple((kind, int(count)) for kind, count in re.findall(r"^(\w+) (\d+)$", output, re.MULTILINE))
                if self.usual_work and takes_longer(calls, self.usual_work):
                    return "work"
                self.usual_work = self.usual_work or calls
        return None

    def unbroken(self) -> str:
        """The digest of random calls."""
        failed = self.judge({}, "")
        if failed != "digest":
            sys.exit(f"hopform: {failed} is red before anything is broken")
        digest = run([str(self.folder / "digest")], 60)[1].strip()
        if (failed := self.judge({}, digest)) is not None:
            sys.exit(f"hopform: {failed} is red before anything is broken")
        return digest

    def break_and_judge(self, mutant: Mutant, wanted: str) -> str | None:
        """Who kills a mutant: a program, pytest, the digest; `stillborn` if it does not compile."""
        link = self.src / mutant.file
        link.unlink()
        link.write_text(mutant.apply(text_of(mutant.file)), "utf-8")
        try:
            affected = [unit for unit in self.units if unit != "version.c" and mutant.file in includes(unit)]
            if not self.is_c(affected[0]):
                return "stillborn"
            objects = {}
            for unit in affected:
                objects[unit] = self.folder / f"broken-{unit}.o"
                self.compile(self.src / unit, objects[unit])
            for name in PROGRAMS:
                if mutant.file in sources_in(name):
                    own = f"{name}-{PROGRAMS[name][0].name}.o"
                    objects[own] = self.folder / f"broken-{name}.o"
                    self.compile(PROGRAMS[name][0], objects[own])
            killed_by = self.judge(objects, wanted)
            if self.asks_pytest and killed_by in (None, "digest"):
                return self.pytest(mutant, affected) or killed_by
            return killed_by
        except ValueError:
            return "stillborn"
        finally:
            link.unlink()
            link.symlink_to(SRC / mutant.file)

    def pytest(self, mutant: Mutant, affected: list[str]) -> str | None:
        """`pytest` if one of the nearest tests fails on a library with the mutant in it."""
        library = self.folder / "library.so"
        broken = [self.folder / f"fast-{unit}.o" for unit in affected]
        flags = [*COMMON, "-O1", "-fPIC", "-w", *self.include]
        for unit, made in zip(affected, broken, strict=True):
            run(["gcc", *flags, "-c", str(self.src / unit), "-o", str(made)], 120)
        others = [path for path in whole_library() if path.stem not in {unit.removesuffix(".c") for unit in affected}]
        run(["gcc", "-shared", *map(str, [*broken, *others]), "-o", str(library), "-lm"], 60)
        unit = mutant.file.rpartition("_")[0]
        names = list(dict.fromkeys((*NEAREST.get(unit, ()), *USUAL)))[:4]
        files = [str(next(ROOT.glob(f"tests/*/test_{name}.py"))) for name in names]
        environment = os.environ | {"HOPFORM_OTHER_LIBRARY": str(library), "HOPFORM_SEED": "1"}
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "tests.other_library", "-p", "no:cacheprovider",
                   "-k", "not numpy and not random", *files]  # fmt: skip
        try:
            done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, timeout=600, check=False)
        except subprocess.TimeoutExpired:
            return "pytest"
        return "pytest" if done.returncode else None


@cache
def whole_library() -> tuple[Path, ...]:
    """Objects of all sources, as a library for Python takes them."""
    folder = Path(tempfile.mkdtemp(prefix="hopform-"))
    made = []
    for source in sorted(SRC.glob("*.c")):
        made.append(folder / f"{source.stem}.o")
        command = [
            "gcc",
            *COMMON,
            "-O1",
            "-fPIC",
            "-w",
            "-I",
            str(C / "include"),
            "-c",
            str(source),
            "-o",
            str(made[-1]),
        ]
        if run(command, 600)[0]:
            sys.exit(f"hopform: {source.name} does not compile")
    return tuple(made)


@dataclass(frozen=True)
class Verdict:
    mutant: Mutant
    killed_by: str | None


def argued() -> set[str]:
    """Mutants that the page argues to be equivalent: their descriptions, as printed, without the line's number."""
    text = PAGE.read_text("utf-8") if PAGE.is_file() else ""
    return set(re.findall(r"^- (.+)$", text.partition("## Equivalent")[2], re.MULTILINE))


def without_line(described: str) -> str:
    return re.sub(r":\d+:", ":", described, count=1)


def draw(count: int, seed: int, jobs: int, asks_pytest: bool, seconds: float) -> list[Verdict]:
    """Verdicts on so many mutants that compile, in the order drawn; fewer if the time is over."""
    mutants = pool_of_mutants()
    order = random.Random(seed).sample(mutants, len(mutants))
    print(f"{len(mutants)} places to break; seed {seed}; {' '.join(compiler())}", flush=True)
    folder = Path(tempfile.mkdtemp(prefix="hopform-"))
    benches: Queue[Bench] = Queue()
    (folder / "0").mkdir()
    first = Bench(folder / "0", asks_pytest)
    wanted = first.unbroken()
    for bench in (first, *(first.twin(folder / str(n)) for n in range(1, jobs))):
        benches.put(bench)
    if asks_pytest:
        whole_library()

    last = time.monotonic() + seconds

    def verdict(mutant: Mutant) -> Verdict:
        bench = benches.get()
        try:
            if time.monotonic() > last:
                return Verdict(mutant, "late")
            return Verdict(mutant, bench.break_and_judge(mutant, wanted))
        finally:
            benches.put(bench)

    verdicts: list[Verdict] = []
    with ThreadPoolExecutor(jobs) as pool:
        start = 0
        while len(verdicts) < count and start < len(order) and time.monotonic() < last:
            batch = order[start : start + count - len(verdicts)]
            start += len(batch)
            for found in pool.map(verdict, batch):
                if found.killed_by in ("stillborn", "late"):
                    continue
                verdicts.append(found)
                if len(verdicts) % 25 == 0:
                    print(
                        f"{len(verdicts)}, {sum(v.killed_by is not None for v in verdicts)} of them killed", flush=True
                    )
                if found.killed_by in (None, "digest", "pytest"):
                    print(
                        f"{found.killed_by or 'SURVIVES'}: {found.mutant.describe(text_of(found.mutant.file))}",
                        flush=True,
                    )
    shutil.rmtree(folder)
    return verdicts


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutation.c", description=__doc__)
    parser.add_argument("--count", type=int, default=400)
    parser.add_argument("--seed", type=int, default=None, help="drawn, and printed, if not given")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--pytest", action="store_true", help="ask the nearest tests of pytest about survivors, half a minute each"
    )
    parser.add_argument("--seconds", type=float, default=math.inf, help="no more are begun after these")
    chosen = parser.parse_args()
    seed = chosen.seed if chosen.seed is not None else random.SystemRandom().randrange(10**6)
    began = time.perf_counter()
    verdicts = draw(chosen.count, seed, chosen.jobs, chosen.pytest, chosen.seconds)
    killers = Counter(found.killed_by or "survived" for found in verdicts)
    known = argued()
    equivalent = [
        v for v in verdicts if v.killed_by is None and without_line(v.mutant.describe(text_of(v.mutant.file))) in known
    ]
    survived = killers["survived"] - len(equivalent)
    killed = len(verdicts) - killers["survived"]
    without_digest = killed - killers["digest"]
    print(f"{len(verdicts)} mutants, seed {seed}, {time.perf_counter() - began:.0f} s: {dict(killers.most_common())}")
    print("by operator, killed of drawn: " + ", ".join(
        f"{name} {sum(v.killed_by is not None for v in verdicts if v.mutant.operator == name)}/{count}"
        for name, count in sorted(Counter(v.mutant.operator for v in verdicts).items())))  # fmt: skip
    print(f"killed {100 * killed / len(verdicts):.1f} %, without the digest {100 * without_digest / len(verdicts):.1f} "
          f"%, equivalent {100 * len(equivalent) / len(verdicts):.1f} %, survived unargued {survived}")  # fmt: skip
    return int(killed < LEAST * len(verdicts) or len(equivalent) > MOST_EQUIVALENT * len(verdicts))


if __name__ == "__main__":
    raise SystemExit(main())
