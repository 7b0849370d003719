"""The tests in C that are run on a mutant of the engine: on a library that differs in one line."""

import re
import resource
import shutil
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass
from pathlib import Path

from derive.emit.instantiate import instantiate
from derive.emit.sources import instance
from derive.model.precisions import F32, F64, Precision
from tests.conformance.firmware.targets import BOARDS, COMMON, HERE, ROOT, C, Failed, run, tables

FUZZ = ROOT / "tests" / "fuzz"
BOARD, REPLAY = BOARDS / "board.c", FUZZ / "replay.c"
FOUND = tuple(map(str, sorted((FUZZ / "found").iterdir())))
INPUTS, BATCHES = "1500", "300"
"""Pseudorandom inputs of a fuzzing target, beside what fuzzing has found."""
SIZES = ("-DDIGEST_ROBOTS=1250", "-DDIGEST_COMMANDS=250", "-DDIGEST_SAMPLES=2250")
DEFINE = {F32: ("-DSINGLE",), F64: ("-DDOUBLE", "-DDOUBLE_ALONE")}
LIMIT = 60.0
TIME_FACTOR, TIME_ALLOWANCE = 3.0, 2.0
"""[s] of a processor: for a program on the engine. A mutant's may take so many times that, and so much more."""
NO_C = ("int-conversion", "incompatible-pointer-types", "implicit-function-declaration", "return-type")
"""Warnings that make a mutant no C."""
EVALUATED = ("-O0", "-fPIC", "-fsanitize=bounds", "-fsanitize-undefined-trap-on-error", "-fsanitize-coverage=trace-pc")
OPTIMISED = ("-O2", "-fno-guess-branch-probability")
GROWTH_OF_KIND, GROWTH_OF_CALL, BLOCKS_ALLOWED = 1.02, 1.1, 50
"""Blocks that the calls of a kind may take together, over what they took; blocks that one call may take, and more."""


class InvalidMutant(Exception):
    """A mutant that does not compile, or is equivalent."""


@dataclass(frozen=True)
class Program:
    """An ordinary test in C, in both precisions unless it is `once`; of a digest, the output must be the engine's."""

    name: str
    sources: tuple[Path, ...]
    define: tuple[str, ...] = ()
    arguments: tuple[str, ...] = ()
    is_digest: bool = False
    once: bool = False


COUNTER = FUZZ.parent / "mutation" / "counter.c"
ANSWERS = Program("answers", (HERE / "answers.c",), arguments=("work",), once=True)
PROGRAMS = (
    Program("selftest", (HERE / "selftest.c", BOARD, COUNTER), is_digest=True),
    *(Program(f"fuzz_{entry}", (FUZZ / f"fuzz_{entry}.c", REPLAY, COUNTER), ("-DENTRY=4",), (INPUTS, *FOUND))
      for entry in ("flight", "control", "entry", "reading", "plant")),
    *(Program(name, (HERE / f"{name}.c", BOARD, COUNTER)) for name in ("refusals", "garbage")),
    Program("contract_batches", (ROOT / "tests" / "conformance" / "contract_batches.c", COUNTER)),
    Program("hops", (ROOT / "tests" / "conformance" / "hops.c", COUNTER)),
    Program("batches", (ROOT / "tests" / "conformance" / "batches.c",), arguments=("work",)),
    Program("fuzz_batch", (FUZZ / "fuzz_batch.c", REPLAY, COUNTER), (), (BATCHES, *FOUND)),
    ANSWERS,
    Program("digests", (HERE / "digests.c", BOARD, COUNTER), SIZES, is_digest=True),
    Program("contract", (HERE / "contract.c", BOARD, COUNTER), once=True),
)  # fmt: skip
"""In the order of what they take."""


class Bench:
    """A folder with a copy of the library's sources, its objects, and the programs that are linked to it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        shutil.copytree(C / "src", folder / "src")
        self.includes = {unit.name: self._included(unit) for unit in sorted((folder / "src").glob("*.c"))}
        for unit in self.includes:
            self._compiled(unit, "o")
        self.optimised = dict[str, bytes]()
        self._link()
        self.expected, self.limits = dict[str, str](), dict[str, float]()
        self.programs = {precision: self._linked(precision) for precision in (F64, F32)}

    def duplicate(self, folder: Path) -> "Bench":
        """Another one, without making all that again."""
        shutil.copytree(self.folder, folder)
        other = copy(self)
        other.folder = folder
        return other

    def _linked(self, precision: Precision) -> dict[str, Program]:
        """The programs in a precision, by what runs them."""
        images = dict[str, Program]()
        for program in PROGRAMS:
            if program.once and precision != F64:
                continue
            image = f"{program.name}_{precision.name}"
            include = [f"-I{folder}" for folder in (C / "include", BOARDS, tables())]
            run(["gcc", *COMMON, "-D_GNU_SOURCE", "-w", "-O1", *DEFINE[precision], *program.define, *include,
                 *map(str, program.sources), f"-L{self.folder}", "-lhopform", "-Wl,-rpath,$ORIGIN", "-lm",
                 "-o", str(self.folder / image)])  # fmt: skip
            images[image] = program
            began = processor_time()
            self.expected[image] = self._output(image, program, LIMIT)
            self.limits[image] = TIME_FACTOR * (processor_time() - began) + TIME_ALLOWANCE
        return images

    def _output(self, image: str, program: Program, limit: float) -> str:
        return run([str(self.folder / image), *program.arguments], limit)

    def _included(self, unit: Path) -> frozenset[str]:
        """The names of the files that a unit is made of."""
        return frozenset(Path(each).name for each in run(["gcc", "-MM", f"-I{C / 'include'}", str(unit)]).split())

    def _compiled(self, unit: str, suffix: str, flags: tuple[str, ...] = EVALUATED) -> Path:
        """The object of a unit, by default with the flags of the tests."""
        target = self.folder / f"{unit}.{suffix}"
        errors = [f"-Werror={name}" for name in NO_C]
        source = self.folder / "src" / unit
        try:
            run(["gcc", *COMMON, *errors, *flags, f"-I{C / 'include'}", "-c", str(source), "-o", str(target)])
        except Failed as error:
            raise InvalidMutant(str(error)) from None
        return target

    def _link(self, broken: Collection[str] = ()) -> None:
        objects = [f"{self.folder / unit}.{'broken' if unit in broken else 'o'}" for unit in self.includes]
        run(["gcc", "-shared", *objects, "-o", str(self.folder / "libhopform.so")])

    def _units(self, file: str, precision: Precision) -> tuple[Path, list[str]]:
        """The instance of a source of the engine, and the units that hold it."""
        path = self.folder / "src" / Path(instance(file)).name.replace("_real", f"_{precision.name}")
        return path, [unit for unit, names in self.includes.items() if path.name in names]

    def killed_by(self, file: str, text: str) -> str | None:
        """The program that fails where a source of the engine has this text; `work` if its calls take longer."""
        for precision, programs in self.programs.items():
            path, units = self._units(file, precision)
            with replaced(path, instance_of(file, text, precision)):
                for unit in units:
                    self._compiled(unit, "broken")
            self._link(units)
            now = dict[str, str]()
            for image, program in programs.items():
                if program is ANSWERS and self._is_same(file, text):  # before what takes seconds
                    raise InvalidMutant(f"{file}: the same objects")
                try:
                    now[image] = self._output(image, program, self.limits[image])
                except Failed as error:
                    return f"{image}, too slow" if error.code == 124 else image
                if program.is_digest and now[image] != self.expected[image]:
                    return image
            if any(takes_longer(calls(now[image]), calls(self.expected[image])) for image in now):
                return "work"
        return None

    def _is_same(self, file: str, text: str) -> bool:
        """Whether the optimised objects are those of the engine."""
        for precision in self.programs:
            path, units = self._units(file, precision)
            for unit in units:
                if unit not in self.optimised:
                    self.optimised[unit] = self._compiled(unit, "fast", OPTIMISED).read_bytes()
                with replaced(path, instance_of(file, text, precision)):
                    if self._compiled(unit, "fast", OPTIMISED).read_bytes() != self.optimised[unit]:
                        return False
        return True


def instance_of(file: str, text: str, precision: Precision) -> str:
    """A source of the engine as C."""
    return instantiate(text, precision) if "_real" in file else text


@contextmanager
def replaced(path: Path, text: str) -> Iterator[None]:
    """A file with another text, for a while."""
    kept = path.read_bytes()
    path.write_text(text, "utf-8")
    try:
        yield
    finally:
        path.write_bytes(kept)


def processor_time() -> float:
    """[s] of a processor that finished children have taken."""
    taken = resource.getrusage(resource.RUSAGE_CHILDREN)
    return taken.ru_utime + taken.ru_stime


Calls = list[tuple[str, int]]


def calls(printed: str) -> Calls:
    """The kind of each call of answers.c, and the basic blocks that it took."""
    return [(kind, int(count)) for kind, count in re.findall(r"^(\w+) (\d+)$", printed, re.MULTILINE)]


def takes_longer(now: Calls, before: Calls) -> bool:
    """Whether the calls of a kind take more than they may by GROWTH_OF_KIND, or one of them by
    GROWTH_OF_CALL.

    Other calls than before say nothing.
    """
    if [kind for kind, _ in now] != [kind for kind, _ in before]:
        return False
    sums, usual = Counter[str](), Counter[str]()
    for (kind, count), (_, least) in zip(now, before, strict=True):
        if count > GROWTH_OF_CALL * least + BLOCKS_ALLOWED:
            return True
        sums[kind] += count
        usual[kind] += least
    return any(sums[kind] > GROWTH_OF_KIND * usual[kind] for kind in usual)
