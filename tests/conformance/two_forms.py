"""Two forms of the engine over the same random motions of any model: `python -m tests.conformance.two_forms COUNT`.

The library of a model is built twice in each precision, as it ships and with a switch, -DHOPFORM_BY_NODES=1. Endings,
lists of events, times and final states are compared. Where lists differ a form is wrong if neither the exact
motion nor a neighbour has its list (tests/oracle/mechanism, 60 digits). In single precision the exact list is that of
the form that ships in double precision, of the same numbers, and neighbours are sought by that first. The form that
ships is judged where the other one is wrong. Exit code 1 if the form behind the switch is wrong where the other one is
not, or fails to end more often.
"""

import argparse
import ctypes
import random
import shlex
import signal
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from os import environ
from pathlib import Path
from typing import Any

import numpy as np

from tests.conformance.form_draws import KINDS, START, Model, problems
from tests.derived import MODELS, SHIPPED
from tests.objects import SHARED, key, once, run_compiler
from tests.oracle.mechanism import solve
from tests.oracle.mechanism.compare import EXCUSED, RIGHT, WRONG, Answer, capped, later_phases
from tests.oracle.mechanism.neighbour import difference, neighbour, solved
from tests.oracle.mechanism.numbers import ulp

NAMES = sorted({path.stem for path in (*SHIPPED.glob("*.py"), *MODELS.glob("*.py"))} - {"__init__"})
BATCH, MAX_PHASES = 10_000, 100
TOO_MANY, UNCERTIFIED = 4, 5
ULPS, NEIGHBOURS = 32, 400
PARTING, MOVES = 2, 12
"""Phases before a difference whose starts are moved, and how often."""
MOST, SECONDS = 12, 15.0
"""Lists that differ which are judged of each table row and batch, and the processor time of each judgement."""
DIGITS = {True: 53, False: 24}
LATE = 1e-2
"""[duration] Equal lists whose times are further apart, in double precision, count as lists that differ."""
ANSWER = np.dtype([("duration", "f8"), ("end", "f8", 4), ("ending", "i8"), ("count", "i8"), ("first", "i8")])
EVENT = np.dtype([("t", "f8"), ("kind", "i8")])


@dataclass(frozen=True)
class Motions:
    """What a form says of some problems."""

    answers: Any
    events: Any

    def list_of(self, lane: int) -> tuple[int, ...]:
        """Kinds of the events, and the ending last."""
        answer = self.answers[lane]
        return (
            *self.events["kind"][answer["first"] : answer["first"] + answer["count"]].tolist(),
            int(answer["ending"]),
        )

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


class Form:
    """A library of one form of a model in one precision."""

    def __init__(self, store: Path, model: Model, *, flags: Sequence[str], double: bool, level: str) -> None:
        c, word = model.folder / "c", "f64" if double else "f32"
        kind = "stance" if (c / "src" / "stance_f64.h").exists() else "motion"
        unit = [f'-DUNIT="{kind}_{word}.h"', f"-DSOLVE=hopform_solve_{kind}", f"-DMOTION=hopform_{kind}"]
        command = [
            *shlex.split(environ.get("CC") or "cc"),
            *SHARED,
            level,
            *unit,
            *(["-DDOUBLE"] if double else []),
            *flags,
        ]
        command += [f"-I{c / each}" for each in ("include", "src")] + [str(Path(__file__).with_suffix(".c"))]
        text = subprocess.run([*command, "-E", "-P"], capture_output=True, text=True, check=True).stdout
        path = store / f"two_forms_{model.name}_{key(text, *command[: len(SHARED) + 2])}.so"
        self.double, self.path = double, once(path, lambda aside: run_compiler(*command, "-o", aside, "-lm"))
        self._library = ctypes.CDLL(str(self.path))
        for name in ("solve", "plan_size", "asked"):
            getattr(self._library, name).restype = ctypes.c_int64

    @property
    def plan_size(self) -> int:
        return int(self._library.plan_size())

    @property
    def asked(self) -> int:
        """How often the form behind the switch counted something so far."""
        return int(self._library.asked())

    def solve(self, lanes: Any) -> Motions:
        """With at most MAX_PHASES phases each; where a problem is refused its ending is below 0."""
        lanes = np.ascontiguousarray(lanes)
        answers, events = np.zeros(len(lanes), ANSWER), np.zeros(len(lanes) * MAX_PHASES + 1, EVENT)
        count = self._library.solve(
            ctypes.c_void_p(lanes.ctypes.data), ctypes.c_int64(len(lanes)), ctypes.c_void_p(answers.ctypes.data),
            ctypes.c_void_p(events.ctypes.data), ctypes.c_int64(len(events)),
        )  # fmt: skip
        return Motions(answers, events[:count])


@dataclass
class Tally:
    """What was seen: motions, lists that differ, and of those judged the ones in which a form is wrong."""

    motions: int = 0
    refused: int = 0
    differ: int = 0
    wrong: int = 0
    wrong_as_ships: int = 0
    """Of the lists in which the form behind the switch is wrong."""
    unsettled: int = 0
    late: float = 0.0
    usual: float = 0.0
    """How far all but one in a thousand of the times are apart at most."""
    latest: tuple[int, int] = (0, 0)
    """The largest difference of a time of equal lists, relative to the duration; its seed and lane."""
    moved: float = 0.0
    stuck: int = 0
    stuck_as_ships: int = 0
    cases: list[tuple[int, int, str]] = field(default_factory=list)
    """Seed, lane and verdict of the first lists that differ."""

    def add(self, other: "Tally") -> None:
        if other.late > self.late:
            self.late, self.latest = other.late, other.latest
        self.usual = max(self.usual, other.usual)
        self.moved = max(self.moved, other.moved)
        for name in ("motions", "refused", "differ", "wrong", "wrong_as_ships", "unsettled", "stuck", "stuck_as_ships"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.cases = [*self.cases, *other.cases]

    @property
    def row(self) -> str:
        return (
            f"{self.motions:8d} {self.differ:6d} {self.wrong:5d} {self.wrong_as_ships:5d} {self.unsettled:5d} "
            f"{self.late:9.2g} {self.moved:9.2g} {self.stuck:5d} {self.stuck_as_ships:5d}  "
            f"{self.latest[0]}/{self.latest[1]}"
        )


HEAD = " motions differ wrong ships  uns.     times    states stuck ships  latest"


class Pair:
    """A model with the switch on and as it ships, in one precision, and what judges both."""

    def __init__(
        self, store: Path, model: Model, *, double: bool, flag: str = "HOPFORM_BY_NODES", level: str = "-O1"
    ) -> None:
        def form(on: bool, double: bool) -> Form:
            return Form(store, model, flags=[f"-D{flag}={int(on)}"], double=double, level=level)

        self.model, self.double = model, double
        self.on, self.ships = form(True, double), form(False, double)
        self.exact = self.ships if double else form(False, True)
        self.same = self.on.path == self.ships.path

    def compare(self, kind: str, seed: int, count: int, most: int = MOST) -> Tally:
        """`count` motions of a kind, of which so many lists that differ are judged."""
        lanes = problems(self.model, kind, seed, count, self.double)
        on, ships = self.on.solve(lanes), self.ships.solve(lanes)
        solved = ships.answers["ending"] > 0
        refuses = (on.answers["ending"] > 0) != solved
        assert not refuses.any(), (
            f"one form alone refuses {self.model.name}, {kind}, {seed}: {np.flatnonzero(refuses)[:5]}"
        )
        equal = np.array([p == q for p, q in zip(on.lists, ships.lists, strict=True)])
        tally = Tally(int(solved.sum()), int((~solved).sum()))
        late = self.measure(tally, lanes, on, ships, solved & equal, seed)
        differ = np.union1d(np.flatnonzero(solved & ~equal), late)
        tally.differ = len(differ)
        tally.stuck, tally.stuck_as_ships = (
            int(np.isin(each.answers["ending"], (TOO_MANY, UNCERTIFIED)).sum()) for each in (on, ships)
        )
        for lane in differ[:most]:
            self.judge(tally, lanes[lane], [each.list_of(lane) for each in (on, ships)],
                       [self.answer(each, lane) for each in (on, ships)], (seed, int(lane)))  # fmt: skip
        return tally

    def measure(self, tally: Tally, lanes: Any, on: Motions, ships: Motions, same: Any, seed: int) -> Any:
        """How far times and final states of equal lists are apart; states by the largest of their kind. The
        lanes in which times are so far apart that one of them is wrong."""
        at = np.flatnonzero(same & (ships.answers["duration"] > 0.0))
        if not len(at):
            return at
        p, q = on.answers[at], ships.answers[at]
        owner, counts = np.repeat(np.arange(len(at)), q["count"]), q["count"]
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        times = [
            np.r_[each.events["t"][a["first"][owner] + within], a["duration"]] for each, a in ((on, p), (ships, q))
        ]
        off = np.abs(times[0] - times[1]) / np.r_[q["duration"][owner], q["duration"]]
        worst, tally.usual = int(np.argmax(off)), float(np.quantile(off, 0.999))
        tally.late, tally.latest = float(off[worst]), (seed, int(at[np.r_[owner, np.arange(len(at))][worst]]))
        largest = np.maximum(np.abs(q["end"]), np.abs(lanes["start"][at]))
        place, speed = (largest[:, columns].max(axis=1) for columns in ([0, 3], [1, 2]))
        place, speed = np.maximum(place, speed * q["duration"]), np.maximum(speed, place / q["duration"])
        with np.errstate(invalid="ignore"):  # of nothing that never moves
            apart = np.abs(p["end"] - q["end"]) / np.stack([place, speed, speed, place], axis=1)
        tally.moved = float(np.nan_to_num(apart).max())
        lanes_of = at[np.r_[owner, np.arange(len(at))]]
        return np.unique(lanes_of[off > LATE]) if self.double else at[:0]

    # ---- which of two lists is right ----

    def answer(self, motions: Motions, lane: int) -> Answer:
        """In the words of the 60-digit motion."""
        of, records = motions.answers[lane], self.model.records
        kinds = [records.EVENTS.get(kind, str(kind)) for kind in motions.list_of(lane)[:-1]]
        times = motions.times_of(lane)[:-1].tolist()
        status = records.ENDINGS[int(of["ending"])]
        return Answer(status, float(of["duration"]), list(zip(times, kinds, strict=True)), {}, {})

    def judge(self, tally: Tally, lane: Any, lists: list[Any], answers: list[Answer], place: tuple[int, int]) -> None:
        """Count what is wrong of two lists that differ."""
        said = ["?", "?"]
        try:
            with at_most(SECONDS):
                said = self.verdicts(lane, lists, answers)
        except (TimeoutError, ArithmeticError, ValueError, AssertionError) as error:
            tally.cases.append((*place, f"unsettled: {type(error).__name__} {error}"[:80]))
        tally.unsettled += "?" in said
        tally.wrong, tally.wrong_as_ships = tally.wrong + (said[0] == WRONG), tally.wrong_as_ships + (said[1] == WRONG)
        if "?" not in said:
            tally.cases.append((*place, " ".join(("on", said[0], *(["ships", said[1]] if said[0] == WRONG else [])))))

    def verdicts(self, lane: Any, lists: list[Any], answers: list[Answer]) -> list[str]:
        """Of the form behind the switch; and of the one that ships if the first is wrong, else that it is as good."""
        first = self.verdict(lane, lists[0], answers[0])
        return [first, self.verdict(lane, lists[1], answers[1]) if first == WRONG else EXCUSED]

    def verdict(self, lane: Any, said: Any, answer: Answer) -> str:
        if self.double:
            return by_the_exact(self.problem(lane), answer, DIGITS[True])
        exact = self.exact.solve(lane[None]).list_of(0)
        if said == exact:
            return RIGHT
        near = said in self.neighbours(lane, exact)
        return EXCUSED if near else by_the_exact(self.problem(lane), answer, DIGITS[False])

    def neighbours(self, lane: Any, exact: Any) -> set[Any]:
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
        found = self.exact.solve(many)
        return {exact, *(found.list_of(n) for n in range(NEIGHBOURS))}

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


def by_the_exact(problem: dict[str, Any], answer: Answer, digits: int) -> str:
    """Whether the motion of 60 digits has a list, else a neighbour within 32 units in the last place; also of the
    phases in which the lists part, whose starts the library has rounded."""
    exact = capped(solve(problem), answer)
    if exact.kinds == answer.kinds:
        times = zip(exact.events, answer.events, strict=True)
        late = max([abs(event.time - t) for event, (t, _) in times], default=0)
        return RIGHT if late <= LATE * exact.duration or digits != DIGITS[True] else WRONG
    if neighbour(exact.problem, answer.kinds, digits).found:
        return EXCUSED
    place = difference(exact.kinds, answer.kinds)
    parting = [
        (again, phase.before)
        for phase, (again, _, _) in zip(exact.phases[1:], later_phases(exact), strict=False)
        if phase.before <= place
    ]
    draw = random.Random(1)
    for again, before in reversed(parting[-PARTING:]):
        for _ in range(MOVES):
            inputs, ways = again.inputs(), dict[str, Any]()
            for group in again.groups():
                way = draw.uniform(-ULPS, ULPS) * ulp(inputs[group[0]], digits)
                ways |= {name: inputs[name] + way for name in group}
            moved = solved(again.moved(ways))
            if moved is not None and moved.kinds == answer.kinds[before:]:
                return EXCUSED
    return WRONG


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


def row_of(pair: Pair, kind: str, seed: int, count: int) -> Tally:
    total = Tally()
    for n, first in enumerate(range(0, count, BATCH)):
        total.add(pair.compare(kind, seed + n, min(BATCH, count - first)))
    return total


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.conformance.two_forms", description=__doc__.splitlines()[0])
    parser.add_argument("count", type=int, help="motions of each model, draw and precision")
    parser.add_argument("--model", choices=("all", *NAMES), action="append", help="default: all")
    parser.add_argument("--draw", choices=tuple(KINDS), action="append", help="default: all")
    parser.add_argument("--f64", action="store_true", help="double precision alone")
    parser.add_argument("--f32", action="store_true", help="single precision alone")
    parser.add_argument("--flag", default="HOPFORM_BY_NODES", help="the switch (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--store", type=Path, help="where libraries are kept, a folder per state of the sources")
    chosen = parser.parse_args()
    names = NAMES if "all" in (chosen.model or ["all"]) else chosen.model
    worse = False
    with tempfile.TemporaryDirectory() as folder:
        store = chosen.store or Path(folder)
        store.mkdir(parents=True, exist_ok=True)
        print(f"{'model':15} {'draw':12} {'of':3} {HEAD}")
        for name in names:
            model = Model(store, name)
            for double in [each for each in (True, False) if (each or not chosen.f64) and not (each and chosen.f32)]:
                pair, word = (
                    Pair(store, model, double=double, flag=chosen.flag, level="-O2"),
                    "f64" if double else "f32",
                )
                if pair.same:
                    print(f"{name:15} {'all':12} {word} the switch changes nothing", flush=True)
                    continue
                for kind in chosen.draw or KINDS:
                    total = row_of(pair, kind, chosen.seed, chosen.count)
                    print(f"{name:15} {kind:12} {word} {total.row}", flush=True)
                    for case in total.cases[:5]:
                        print(f"{'':15} seed {case[0]} lane {case[1]}: {case[2]}")
                    worse = worse or total.wrong > total.wrong_as_ships or total.stuck > total.stuck_as_ships
                sizes = pair.on.plan_size, pair.ships.plan_size
                print(
                    f"{name:15} {'':12} {word} plan {sizes[0]} B for {sizes[1]} B, counted {pair.on.asked}", flush=True
                )
    return int(worse)


if __name__ == "__main__":
    raise SystemExit(main())
