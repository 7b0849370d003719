"""The engine's lists of events of random motions of any model, judged: `python -m tests.conformance.judge COUNT`.

Each model, draw (tests/conformance/motion_draws.py) and precision is a row. Exact lists come from the checker, in 113
bits (tests/oracle/checker/motion.c). A list that differs, or whose motion the checker leaves unsettled, goes to the
motion of 60 digits (tests/oracle/mechanism). It is wrong if neither that motion nor a neighbour has it: inputs, or the
start of a phase, moved by up to 32 units in the last place. `--before` has the engine of another state of the tree in
place of the checker: what both say is not looked at, and where they differ both are judged. Exit code 1 if a list is
wrong in double precision, or a motion has no end; with `--before`, if there are more of them than before.

| column | motions |
|---|---|
| motions | that the engine solves |
| differ | of another list than the checker's (or than before), of unsettled ones, and late ones in double precision |
| judged | of these, by 60 digits: at most --most of each 10 000 |
| wrong | of those judged, of which neither the exact motion nor a neighbour has the list |
| uns. | of those judged, undecided after 15 s of processor time |
| stuck | without an end: uncertified, or too many phases where the exact motion has fewer |
| late | with a time that is off by more than a hundredth of the duration |
| times | the largest difference of a time, relative to the duration; seed and lane of it |
"""

import argparse
import ctypes
import os
import shlex
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from os import environ
from pathlib import Path
from typing import Any

import numpy as np

from tests.conformance.motion_draws import KINDS, START, Model, physics, problems
from tests.derived import MODELS, SHIPPED
from tests.objects import SHARED, key, once, run_compiler
from tests.oracle.checker import MOTION_KINDS, MOTION_OUTCOMES, MOTION_PROBLEM, motions
from tests.oracle.mechanism import Solution, solve
from tests.oracle.mechanism.compare import EXCUSED, RIGHT, WRONG, Answer, capped, later_phases
from tests.oracle.mechanism.neighbour import difference, neighbour

ROOT = Path(__file__).resolve().parents[2]
NAMES = sorted({path.stem for path in (*SHIPPED.glob("*.py"), *MODELS.glob("*.py"))} - {"__init__"})
BATCH, MAX_PHASES = 10_000, 100
TOO_MANY, UNCERTIFIED, UNSETTLED = 4, 5, 0
ULPS, NEIGHBOURS = 32, 400
PARTING = 2
"""Phases before a difference whose starts are moved."""
MOST, SECONDS = 12, 15.0
"""Lists that differ which are judged of each row and batch, and the processor time of each judgement."""
LONG = 0.9
"""[MAX_PHASES] So many phases of an exact motion are more than the engine has."""
DIGITS = {True: 53, False: 24}
LATE, SHORTEST = 1e-2, 1e-6
"""[duration] A time that is further off is late; a duration counts as so much of the horizon at least."""
ANSWER = np.dtype([("duration", "f8"), ("end", "f8", 4), ("ending", "i8"), ("count", "i8"), ("first", "i8")])
EVENT = np.dtype([("t", "f8"), ("kind", "i8")])


@dataclass(frozen=True)
class Motions:
    """Of some problems: endings, durations, and the events of all, of which each has `count` from `first` on."""

    answers: Any
    events: Any
    phases: Any = None
    """How many each has, of exact ones."""

    def list_of(self, lane: int) -> tuple[int, ...]:
        """Kinds of the events, and the ending last."""
        answer = self.answers[lane]
        kinds = self.events["kind"][answer["first"] : answer["first"] + answer["count"]]
        return (*kinds.tolist(), int(answer["ending"]))

    def times_of(self, lane: int) -> Any:
        """Of the events, and of the ending."""
        answer = self.answers[lane]
        return np.append(self.events["t"][answer["first"] : answer["first"] + answer["count"]], answer["duration"])

    @cached_property
    def lists(self) -> list[bytes]:
        kinds = self.events["kind"].astype("i1")
        return [
            kinds[first : first + count].tobytes() + bytes([ending & 255])
            for first, count, ending in self.answers[["first", "count", "ending"]].tolist()
        ]  # fmt: skip


def generated_by(tree: Path, store: Path, model: Model) -> Path:
    """The folder that another state of the tree generates of a model of this one."""

    def make(aside: Path) -> None:
        command = [sys.executable, "-m", "derive", "--model", model.file, "--out", aside]
        path = os.pathsep.join(map(str, (tree, tree / "runtime")))
        subprocess.run(command, cwd=tree, env=environ | {"PYTHONPATH": path}, check=True, stdout=subprocess.DEVNULL)

    return once(store / f"before_{model.name}_{key(tree)}", make)


class Engine:
    """The generated C of a model, compiled in one precision."""

    def __init__(
        self,
        store: Path,
        model: Model,
        *,
        double: bool,
        level: str,
        flags: Sequence[str] = (),
        folder: Path | None = None,
    ) -> None:
        c, word = (folder or model.folder) / "c", "f64" if double else "f32"
        kind = "stance" if (c / "src" / "stance_f64.h").exists() else "motion"
        unit = [f'-DUNIT="{kind}_{word}.h"', f"-DSOLVE=hopform_solve_{kind}", f"-DMOTION=hopform_{kind}"]
        compiler, precision = shlex.split(environ.get("CC") or "cc"), ["-DDOUBLE"] if double else []
        command = [*compiler, *SHARED, level, *unit, *precision, *flags]
        command += [f"-I{c / each}" for each in ("include", "src")] + [str(Path(__file__).with_suffix(".c"))]
        text = subprocess.run([*command, "-E", "-P"], capture_output=True, text=True, check=True).stdout
        path = store / f"judge_{model.name}_{key(text, *command[: len(compiler) + len(SHARED) + 1])}.so"
        self._library = ctypes.CDLL(str(once(path, lambda aside: run_compiler(*command, "-o", aside, "-lm"))))
        self._library.solve.restype = ctypes.c_int64

    def solve(self, lanes: Any) -> Motions:
        """With at most MAX_PHASES phases each; where a problem is refused its ending is below 0."""
        lanes = np.ascontiguousarray(lanes)
        answers, events = np.zeros(len(lanes), ANSWER), np.zeros(len(lanes) * MAX_PHASES + 1, EVENT)
        count = self._library.solve(
            ctypes.c_void_p(lanes.ctypes.data), ctypes.c_int64(len(lanes)), ctypes.c_void_p(answers.ctypes.data),
            ctypes.c_void_p(events.ctypes.data), ctypes.c_int64(len(events)),
        )  # fmt: skip
        return Motions(answers, events[:count])


def exactly(model: Model, lanes: Any) -> Motions:
    """The motions by the checker; ending UNSETTLED where it cannot tell."""
    answers, events = motions(to_the_checker(model, lanes))
    kinds = {word: kind for kind, word in model.records.EVENTS.items()}
    numbers = [kinds.get(f"{name}_{what}", 0) for name in model.moving for what in MOTION_KINDS]
    answers["ending"][answers["outcome"] != MOTION_OUTCOMES.index("found")] = UNSETTLED
    kinds_of = np.array(numbers)[events["kind"]]
    found = np.zeros(len(events), EVENT)
    found["t"], found["kind"] = events["t"], kinds_of
    return Motions(answers, found, answers["phases"])


def to_the_checker(model: Model, lanes: Any) -> Any:
    """The problems as masses, springs, dampers and forces, by the elements of the model's file."""
    wide = np.longdouble
    robot = {name: lanes["robot"][:, n].astype(wide) for n, name in enumerate(model.fields)}
    start = {name: lanes["start"][:, n].astype(wide) for n, name in enumerate(START)}
    made, given = physics(model, robot, lawful=False), np.zeros(len(lanes), MOTION_PROBLEM)
    of, size = made.of, range(len(model.moving))
    q = model.places(robot, start)
    v = [start[name] for name, moves in (("v1", model.first_moves), ("v2", model.second_moves)) if moves]
    given["low"], given["high"] = -np.inf, np.inf
    for i in size:
        given["m"][:, i], given["g"][:, i], given["v"][:, i] = made.M[i], made.drive[i], v[i]
        for j in size:
            given["K"][:, i, j], given["B"][:, i, j] = made.K[i][j], made.B[i][j]
        levels = of.friction.get(model.moving[i], ((0.0, 0.0), (0.0, 0.0)))
        ends = of.stops.get(model.moving[i], (-np.inf, np.inf))
        for side in (0, 1):
            given["slides"][:, i, side], given["rests"][:, i, side] = levels[0][side], levels[1][side]
        given["low"][:, i], given["high"][:, i] = (end - q[i] for end in ends)
    whole = [model.stretched(robot, *row) for row in ([0.0] * len(size), *np.eye(len(size)).tolist())]
    of_y = [each - whole[0] for each in whole[1:]] + whole[:1]
    for on, value in of.springs:
        by, slack = of.along(on), on.by.get("", 0.0)
        stretch, terms = sum(by[j] * q[j] for j in size) + slack, sum(abs(by[j] * q[j]) for j in size) + abs(slack)
        for side in (1.0, -1.0):  # a spring that is stretched by y, whose digits the start has
            is_y = np.all([side * p == r + 0.0 * slack for p, r in zip((*by, slack), of_y, strict=True)], axis=0)
            stretch, terms = np.where(is_y, side * start["y"], stretch), np.where(is_y, abs(start["y"]), terms)
        for i in size:
            given["F"][:, i] -= value * stretch * by[i]
            given["F_size"][:, i] += abs(value * terms * by[i])
        if of.stands and of.in_leg(on):
            given["lift_0"] -= np.where(start["y"] == 0.0, 0.0, value * by[-1] * stretch)
            for j in size:
                given["lift"][:, j] -= value * by[-1] * by[j]
    for on, value in of.dampers if of.stands else ():
        for j in size if of.in_leg(on) else ():
            given["lift"][:, 2 + j] -= value * of.along(on)[-1] * of.along(on)[j]
    for name, row in of.forces:
        given["F"][:, model.moving.index(name)] += row.by.get("", 0.0)
        given["F_size"][:, model.moving.index(name)] += abs(row.by.get("", 0.0))
    if of.law:
        given["p"], given["d"], given["limit"] = (*of.law, of.limit)
    given["q"], given["horizon"], given["t"], given["u"] = q[0], lanes["horizon"], lanes["t"], lanes["u"]
    given["size"], given["stands"], given["lawful"], given["steps"] = len(size), of.stands, bool(of.law), lanes["steps"]
    return given


@dataclass
class Tally:
    """What was seen of some motions; the docstring above has the columns."""

    motions: int = 0
    differ: int = 0
    judged: int = 0
    wrong: int = 0
    unsettled: int = 0
    stuck: int = 0
    late: int = 0
    wrong_before: int = 0
    stuck_before: int = 0
    found_exactly: int = 0
    """Motions whose list the checker has settled."""
    times: float = 0.0
    usual: float = 0.0
    """How far all but one in a thousand of the times are off at most, of a batch."""
    latest: tuple[int, int] = (0, 0)
    cases: list[tuple[int, int, str]] = field(default_factory=list)
    """Seed, lane and verdict of what was judged: its list is unlike a settled one, or the checker leaves it unsettled."""

    def add(self, other: "Tally") -> None:
        if other.times > self.times:
            self.times, self.latest = other.times, other.latest
        self.usual = max(self.usual, other.usual)
        for each in fields(self):
            if isinstance(getattr(self, each.name), int):
                setattr(self, each.name, getattr(self, each.name) + getattr(other, each.name))
        self.cases = [*self.cases, *other.cases]

    @property
    def row(self) -> str:
        return (
            f"{self.motions:8d} {self.differ:6d} {self.judged:6d} {self.wrong:5d} {self.unsettled:4d} "
            f"{self.stuck:5d} {self.late:5d} {self.times:8.2g} {self.latest[0]}/{self.latest[1]}"
        )

    @property
    def row_before(self) -> str:
        return f"{self.row}  before: wrong {self.wrong_before}, stuck {self.stuck_before}"


HEAD = " motions differ judged wrong uns. stuck  late    times seed/lane"


class Judge:
    """The engine of a model in one precision, and what judges it: exact motions, or first the engine of before."""

    def __init__(
        self, store: Path, model: Model, *, double: bool, level: str = "-O1", flags: Sequence[str] = (),
        before: Path | None = None,
    ) -> None:  # fmt: skip
        """before: a folder that another state of the tree has generated of the model, with c/include and c/src."""
        self.model, self.double = model, double
        self.engine = Engine(store, model, double=double, level=level, flags=flags)
        self.before = before and Engine(store, model, double=double, level=level, folder=before)

    def judge(self, kind: str, seed: int, count: int, most: int = MOST) -> Tally:
        """`count` motions of a kind, of which so many lists that differ go to the 60 digits."""
        drawn = problems(self.model, kind, seed, count, self.double)
        at = np.flatnonzero(self.engine.solve(drawn).answers["ending"] > 0)
        lanes = drawn[at]
        found, known = self.engine.solve(lanes), self.known(lanes)
        same = np.array([is_list(p, q) for p, q in zip(found.lists, known.lists, strict=True)], bool)
        gave_up = found.answers["ending"] == TOO_MANY
        same &= ~gave_up | (known.phases >= LONG * MAX_PHASES)
        tally = Tally(len(lanes), found_exactly=int((known.answers["ending"] != UNSETTLED).sum()))
        late = self.measure(tally, found, known, lanes, same & ~gave_up, (seed, at))
        differ = np.union1d(np.flatnonzero(~same), late if self.double else late[:0])
        tally.differ, tally.late = len(differ), len(late)
        has_few = (known.answers["ending"] != UNSETTLED) & (known.phases < LONG * MAX_PHASES)
        tally.stuck = int(((found.answers["ending"] == UNCERTIFIED) | (gave_up & has_few)).sum())
        if self.before:
            ending = known.answers["ending"]
            tally.stuck_before = int(((ending == UNCERTIFIED) | ((ending == TOO_MANY) & ~gave_up)).sum())
        for lane in differ[:most]:
            said = [self.answer(each, lane) for each in ((found, known) if self.before else (found,))]
            how = "where unsettled" if known.answers["ending"][lane] == UNSETTLED else "unlike"
            self.settle(tally, lanes[lane], said, (seed, int(at[lane])), how)
        return tally

    def known(self, lanes: Any) -> Motions:
        """What the engine's motions are compared with."""
        if not self.before:
            return exactly(self.model, lanes)
        found = self.before.solve(lanes)
        refused = np.flatnonzero(found.answers["ending"] < 0)
        assert not len(refused), f"{self.model.name}: refused before: {lanes[refused[:1]]}"
        gave_up = found.answers["ending"] == TOO_MANY
        return replace(found, phases=np.where(gave_up, MAX_PHASES, 0))

    def measure(
        self, tally: Tally, found: Motions, known: Motions, lanes: Any, same: Any, drawn: tuple[int, Any]
    ) -> Any:
        """How far times of equal lists are off; the lanes in which one is late. drawn: the seed, and numbers of lanes."""
        at = np.flatnonzero(same & (known.answers["duration"] > 0.0))
        if not len(at):
            return at
        p, q = found.answers[at], known.answers[at]
        counts = q["count"]
        owner, within = (
            np.repeat(np.arange(len(at)), counts),
            np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts),
        )
        times = [
            np.r_[each.events["t"][a["first"][owner] + within], a["duration"]] for each, a in ((found, p), (known, q))
        ]
        owner = np.r_[owner, np.arange(len(at))]
        off = np.abs(times[0] - times[1]) / np.maximum(q["duration"], SHORTEST * lanes["horizon"][at])[owner]
        worst, tally.usual = int(np.argmax(off)), float(np.quantile(off, 0.999))
        tally.times, tally.latest = float(off[worst]), (drawn[0], int(drawn[1][at[owner[worst]]]))
        return np.unique(at[owner[off > LATE]])

    # ---- whether a list is right ----

    def answer(self, motions: Motions, lane: int) -> Answer:
        """In the words of the 60-digit motion."""
        of, records = motions.answers[lane], self.model.records
        kinds = [records.EVENTS.get(kind, str(kind)) for kind in motions.list_of(lane)[:-1]]
        times = motions.times_of(lane)[:-1].tolist()
        status = records.ENDINGS[int(of["ending"])]
        return Answer(status, float(of["duration"]), list(zip(times, kinds, strict=True)), {}, {})

    def settle(self, tally: Tally, lane: Any, said: list[Answer], place: tuple[int, int], how: str) -> None:
        """Count what is wrong of the engine's answer, and of that before; `how` it differs."""
        tally.judged += 1
        try:
            with at_most(SECONDS * len(said)):
                verdicts = [self.verdict(lane, each) for each in said]
        except (TimeoutError, ArithmeticError, ValueError, AssertionError) as error:
            tally.unsettled += 1
            tally.cases.append((*place, f"{how}: undecided, {type(error).__name__} {error}"[:90]))
            return
        tally.wrong += verdicts[0] == WRONG
        tally.wrong_before += verdicts[-1] == WRONG and len(verdicts) > 1
        tally.cases.append((*place, f"{how}: {', before '.join(verdicts)}"))

    def verdict(self, lane: Any, said: Answer) -> str:
        exact = capped(solve(self.problem(lane)), said)
        if differs_from(said, self.double)(exact) is None:
            return RIGHT
        if exact.kinds != said.kinds and not self.double and said.kinds in self.neighbours(lane):
            return EXCUSED
        return EXCUSED if has_neighbour(exact, said, DIGITS[self.double], self.double) else WRONG

    def neighbours(self, lane: Any) -> set[tuple[str, ...]]:
        """Lists of motions whose inputs differ by up to 32 units in the last place; equal numbers stay equal."""
        draw, eps = np.random.default_rng(1), float(np.finfo(np.float32).eps)
        many = np.repeat(lane[None], NEIGHBOURS, axis=0)
        factors: dict[float, Any] = {}

        def moved(value: float) -> Any:
            if abs(value) not in factors:
                ways = draw.uniform(-1.0, 1.0, NEIGHBOURS)
                factors[abs(value)] = (
                    1.0 + np.where(draw.random(NEIGHBOURS) < 0.5, ways, np.sign(ways)) * ULPS * eps / 2
                )
            return value * factors[abs(value)]

        alone = not self.model.second_moves
        for name in ("robot", "start", "u"):
            for n, value in enumerate(lane[name].tolist()):
                if not (name == "start" and n == START.index("y") and alone):
                    many[name][:, n] = moved(value)
        if alone:
            robot = {name: many["robot"][:, n] for n, name in enumerate(self.model.fields)}
            many["start"][:, 3] = self.model.stretched(robot, many["start"][:, 0])
        found = exactly(self.model, many)
        settled = np.flatnonzero(found.answers["ending"] != UNSETTLED)
        return {self.answer(found, int(n)).kinds for n in settled}

    def problem(self, lane: Any) -> dict[str, Any]:
        """For the 60-digit motion."""
        robot = dict(zip(self.model.fields, lane["robot"].tolist(), strict=True))
        start = dict(zip(START, lane["start"].tolist(), strict=True))
        steps = [(lane["t"][n].item(), lane["u"][n].item()) for n in range(lane["steps"])]
        steps = [step for step in steps if step[0] < lane["horizon"]]
        place, speed = (max(abs(start[name]) for name in names) for names in (("x1", "y"), ("v1", "v2")))
        place, speed = max(place, 1e-2 * speed * lane["horizon"], 1e-9), max(speed, place / lane["horizon"], 1e-9)
        units = {"time": 1e-9 * lane["horizon"], "x1": place, "y": place, "v1": speed, "v2": speed}
        return self.model.equations.problem(robot, start, steps, lane["horizon"].item(), units, MAX_PHASES)


def is_list(said: bytes, known: bytes) -> bool:
    """Whether two lists are the same; of one that was given up, as far as it goes."""
    return said == known or (said[-1] == TOO_MANY and known[: len(said) - 1] == said[:-1])


def differs_from(said: Answer, timely: bool) -> Callable[[Solution], int | None]:
    """The first place at which a motion is not what was said: of another list, or with another time, if that counts;
    of one that was given up, as far as it goes.
    """
    ends = [] if said.status == "too_many_phases" else [said.duration]

    def place(solution: Solution) -> int | None:
        times = [*(event.time for event in solution.events), solution.duration]
        most = LATE * max(solution.duration, SHORTEST * solution.problem.horizon)
        off = [abs(p - q) for p, q in zip(times, [*(t for t, _ in said.events), *ends], strict=False)]
        late = next((n for n, each in enumerate(off) if timely and each > most), None)
        if solution.kinds == said.kinds:
            return late
        other = difference(solution.kinds, said.kinds)
        return other if late is None else min(late, other)

    return place


def has_neighbour(exact: Solution, said: Answer, digits: int, timely: bool) -> bool:
    """Whether a motion within 32 units in the last place is what was said; also from phases before the difference,
    whose starts the engine has rounded.
    """
    differs = differs_from(said, timely)
    if neighbour(exact.problem, said.kinds, digits, differs).found:
        return True
    place = differs(exact) or 0
    parting = [
        (again, start, phase.before)
        for phase, (again, start, _) in zip(exact.phases[1:], later_phases(exact), strict=False)
        if phase.before <= place
    ]
    for again, start, before in reversed(parting[-PARTING:]):
        events = [(t - start, kind) for t, kind in said.events[before:]]
        rest = replace(said, duration=said.duration - start, events=events)
        if neighbour(again, rest.kinds, digits, differs_from(rest, timely)).found:
            return True
    return False


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """TimeoutError after so much processor time."""

    def over(*_: Any) -> None:
        raise TimeoutError(f"more than {seconds:g} s")

    before = signal.signal(signal.SIGVTALRM, over)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


def row_of(judge: Judge, kind: str, seed: int, count: int, most: int = MOST) -> Tally:
    total = Tally()
    for n, first in enumerate(range(0, count, BATCH)):
        total.add(judge.judge(kind, seed + n, min(BATCH, count - first), most))
    return total


def tree_of(text: str, store: Path) -> Path:
    """Another state of the tree: its folder, or the files of a revision of git."""
    if Path(text).is_dir():
        return Path(text).resolve()
    found = subprocess.run(
        ["git", "rev-parse", "--verify", f"{text}^{{commit}}"], cwd=ROOT, check=False, capture_output=True, text=True
    )
    if found.returncode:
        raise SystemExit(f"--before {text}: no folder and no revision of git")

    def make(aside: Path) -> None:
        aside.mkdir()
        packed = subprocess.run(
            ["git", "archive", found.stdout.strip(), "derive", "runtime", "templates", "pyproject.toml"],
            cwd=ROOT, check=True, capture_output=True,
        )  # fmt: skip
        subprocess.run(["tar", "-x", "-C", aside], input=packed.stdout, check=True)

    return once(store / f"tree_{found.stdout.strip()[:16]}", make)


def main() -> int:
    about = (__doc__ or "").splitlines()
    parser = argparse.ArgumentParser(prog="python -m tests.conformance.judge", description=about[0])
    parser.add_argument("count", type=int, help="motions of each model, draw and precision")
    parser.add_argument("--model", choices=("all", *NAMES), action="append", help="default: all")
    parser.add_argument("--draw", choices=tuple(KINDS), action="append", help="default: all")
    parser.add_argument("--f64", action="store_true", help="double precision alone")
    parser.add_argument("--f32", action="store_true", help="single precision alone")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most", type=int, default=MOST, help="differences judged of 10 000 motions (%(default)s)")
    parser.add_argument("--before", help="another state of the tree, a folder or a revision of git, to compare with")
    parser.add_argument("--cflags", default="", help="further flags of the compiler, for the engine that is judged")
    parser.add_argument("--store", type=Path, help="where libraries are kept, a folder per state of the sources")
    chosen = parser.parse_args()
    names = NAMES if "all" in (chosen.model or ["all"]) else chosen.model
    bad = False
    with tempfile.TemporaryDirectory() as folder:
        store = chosen.store or Path(folder)
        store.mkdir(parents=True, exist_ok=True)
        tree = tree_of(chosen.before, store) if chosen.before else None
        print(f"{'model':15} {'draw':12} {'of':3} {HEAD}")
        for name in names:
            model = Model(store, name)
            before = tree and generated_by(tree, store, model)
            for double in [each for each in (True, False) if (each or not chosen.f64) and not (each and chosen.f32)]:
                judge = Judge(store, model, double=double, level="-O1", flags=chosen.cflags.split(), before=before)
                for kind in chosen.draw or KINDS:
                    total = row_of(judge, kind, chosen.seed, chosen.count, chosen.most)
                    row = total.row_before if before else total.row
                    print(f"{name:15} {kind:12} {'f64' if double else 'f32'} {row}", flush=True)
                    for case in [each for each in total.cases if not each[2].endswith(RIGHT)][:5]:
                        print(f"{'':15} seed {case[0]} lane {case[1]}: {case[2]}")
                    bad |= total.stuck > total.stuck_before
                    bad |= total.wrong > total.wrong_before and (double or before is not None)
    return int(bad)


if __name__ == "__main__":
    raise SystemExit(main())
