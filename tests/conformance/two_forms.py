"""Both forms of the engine over the same random stances: `python -m tests.conformance.two_forms COUNT`.

two_forms.c is built twice in each precision, as it ships and with HOPFORM_MODAL=1, which solves phases in which both
masses slip by their rates. Lists of events and endings are compared. Where they differ
a form is wrong if the checker certifies the other one alone (f64), or if it is unlike the form that ships in double
precision, of the same numbers (f32). Exit
code 1 if the modal form is wrong more often than the other one.
"""

import argparse
import ctypes
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.conformance import random_stances
from tests.conformance.firmware.targets import C
from tests.conformance.random_stances import MAX_PHASES
from tests.objects import shared_library
from tests.oracle.checker import ANSWER, CERTIFIED, PHASE, PROBLEM, certify

BATCH = 10_000
COUNTED = ("node", "evaluation", "inside", "amplitude", "bernstein", "minimum", "cut", "quiet", "from_the_end")
"""What the modal form counts: nodes, evaluations, functions that signs do not settle, and what settles those."""


class Form:
    """A library of one form and precision."""

    def __init__(self, store: Path, *, modal: bool, double: bool) -> None:
        flags = (f"-DHOPFORM_MODAL={int(modal)}", *(("-DDOUBLE",) if double else ()), *(("-DCOUNTS",) if modal else ()))
        sources = (Path(__file__).with_name("two_forms.c"), C / "src" / "version.c")
        self.modal, self.double = modal, double
        self._library = ctypes.CDLL(str(shared_library(store, "two_forms", sources, *flags)))
        self._library.solve.restype = self._library.plan_size.restype = ctypes.c_int64

    @property
    def plan_size(self) -> int:
        return int(self._library.plan_size())

    def solve(self, problems: Any, loops: int = 1) -> tuple[Any, Any]:
        """ANSWERs and PHASEs, with at most MAX_PHASES phases each; where a problem is refused its ending is below 0."""
        answers, phases = np.zeros(len(problems), ANSWER), np.zeros(len(problems) * (MAX_PHASES + 1), PHASE)
        count = self._library.solve(
            ctypes.c_void_p(problems.ctypes.data), ctypes.c_int64(len(problems)), loops,
            ctypes.c_void_p(answers.ctypes.data), ctypes.c_void_p(phases.ctypes.data), ctypes.c_int64(len(phases)),
        )  # fmt: skip
        return answers, phases[:count]

    def counts(self) -> dict[str, int]:
        found = (ctypes.c_int64 * len(COUNTED))()
        self._library.counts(found)
        return dict(zip(COUNTED, found, strict=True))


@dataclass
class Tally:
    """What was seen: stances, lists that differ, and of those the ones in which a form is wrong."""

    stances: int = 0
    differ: int = 0
    wrong: int = 0
    wrong_as_ships: int = 0
    unsettled: int = 0
    latest: float = 0.0
    cases: list[tuple[int, int]] = field(default_factory=list)
    """Seed and lane of the first lists that differ."""

    def add(self, other: "Tally") -> None:
        for name in ("stances", "differ", "wrong", "wrong_as_ships", "unsettled"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.latest = max(self.latest, other.latest)
        self.cases = [*self.cases, *other.cases][:5]

    def __str__(self) -> str:
        return (
            f"{self.stances} stances, lists differ {self.differ}, of them wrong: modal {self.wrong}, as it ships "
            f"{self.wrong_as_ships}, unsettled {self.unsettled}; durations of all but 1 in 1000 differ by up to "
            f"{self.latest:.2g} of it"
        )


def lists_of(answers: Any, phases: Any) -> list[bytes]:
    """Ending and kinds of events of each stance."""
    kinds = phases["event"]
    return [
        bytes([a["ending"] & 255]) + kinds[a["first"] : a["first"] + a["count"]].tobytes().replace(b"\0", b"")
        for a in answers
    ]


def compare(draw: Callable[[int, int], Any], seed: int, count: int, forms: tuple[Form, Form], judge: Form) -> Tally:
    """`count` stances of a draw, by the modal form and the one that ships; judge: the one that ships, in f64."""
    modal, ships = forms
    problems = draw(seed, count)
    if not modal.double:
        for name in PROBLEM.names or ():
            problems[name] = problems[name].astype("f4")
    found = [form.solve(problems) for form in forms]
    lists = [lists_of(*each) for each in found]
    solved = (found[0][0]["ending"] > 0) & (found[1][0]["ending"] > 0)
    assert (found[0][0]["ending"] > 0).tolist() == (found[1][0]["ending"] > 0).tolist(), "one form alone refuses"
    differ = np.array([i for i in np.flatnonzero(solved) if lists[0][i] != lists[1][i]], int)
    same = np.flatnonzero(solved & (found[0][0]["duration"] > 0.0) & (found[0][0]["count"] == found[1][0]["count"]))
    off = np.abs(found[0][0]["duration"][same] - found[1][0]["duration"][same]) / found[1][0]["duration"][same]
    tally = Tally(
        int(solved.sum()),
        len(differ),
        cases=[(seed, int(i)) for i in differ[:5]],
        latest=float(np.quantile(off, 0.999)) if len(off) else 0.0,
    )
    if not len(differ):
        return tally
    some = problems[differ]
    if modal.double:
        right, other = (certify(some, *form.solve(some), condition=False)["outcome"] == CERTIFIED for form in forms)
        tally.wrong, tally.wrong_as_ships = int((~right & other).sum()), int((right & ~other).sum())
        tally.unsettled = int((right == other).sum())
    else:
        exact = lists_of(*judge.solve(some))
        tally.wrong = sum(lists[0][i] != other for i, other in zip(differ, exact, strict=True))
        tally.wrong_as_ships = sum(lists[1][i] != other for i, other in zip(differ, exact, strict=True))
    return tally


DRAWS: dict[str, Callable[[int, int], Any]] = {
    "random": random_stances.draw_stances,
    **{
        f"a/w {stiffness:.0e}": partial(random_stances.stiff_stances, stiffness=stiffness)
        for stiffness in (1e3, 1e4, 1e5)
    },
}


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.conformance.two_forms", description=__doc__.splitlines()[0])
    parser.add_argument("count", type=int, help="stances of each draw and precision")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--draw", choices=tuple(DRAWS), action="append", help="default: all")
    parser.add_argument("--f64", action="store_true", help="double precision alone")
    chosen = parser.parse_args()
    worse = False
    with tempfile.TemporaryDirectory() as folder:
        store = Path(folder)
        judge = Form(store, modal=False, double=True)
        for double in (True,) if chosen.f64 else (True, False):
            forms = Form(store, modal=True, double=double), Form(store, modal=False, double=double)
            print(f"{'f64' if double else 'f32'}: plan {forms[0].plan_size} B, as it ships {forms[1].plan_size} B")
            for name in chosen.draw or DRAWS:
                total = Tally()
                for n, first in enumerate(range(0, chosen.count, BATCH)):
                    count = min(BATCH, chosen.count - first)
                    total.add(compare(DRAWS[name], chosen.seed + n, count, forms, judge))
                print(f"  {name}: {total}; seed and lane {total.cases}", flush=True)
                worse = worse or total.wrong > total.wrong_as_ships
            print(f"  {forms[0].counts()}")
    return int(worse)


if __name__ == "__main__":
    raise SystemExit(main())
