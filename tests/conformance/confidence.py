"""How often the 95 % intervals by noise alone hold the truth: synthetic recordings of random robots, fitted, all
identifiable parameters pooled.

What intervals allow for beside noise, causes that a recording would not show, is in none of these recordings and is left
out: such an interval holds the truth in all cases (tests/conformance/evidence.py has those with causes).

A drop, a decay and a step response of each robot, a decay by a coarse encoder, of every fourth also a drop with the
actuator free.

`python -m tests.conformance.confidence --count 300` prints a line per parameter. Noise 0.2 mm, quantum 1/56000 m, 200
Hz to 1 kHz.
"""

import argparse
import dataclasses
import math
import time
from collections import defaultdict
from unittest import mock

import numpy as np

import hopform
from hopform.identify import _alternatives as alternatives
from hopform.identify import _estimation as estimation
from hopform.identify import fit as fit_model
from hopform.identify._drop import fit_drop_test
from hopform.identify._fits import Fit
from hopform.identify._motion import of_scipy
from hopform.identify._synthetic import record

QUIET, COUNT = 2e-5, 2e-4
"""[m] noise and step of a coarse encoder, whose last digit rests."""
TRUTH = {"length": "L0", "offset": None}  # of the hopper's letters: the offset is 0, no parameter of a robot
ALONE = {"compare": False, "holdout": False}


def truth(robot: hopform.Robot, test: str) -> dict[str, float]:
    """The parameters of a test: a body on its spring and an actuator against it are slides."""
    if test in ("decay", "counts"):
        return {"k": robot.k, "b": robot.b2, "F": robot.m_s * robot.f2}
    if test == "step":
        return {"k": robot.k, "b": robot.b1, "F": robot.m_eff * robot.f1, "k_f": -robot.gamma2}
    return {field.name: getattr(robot, field.name) for field in robot.fields()} | {"length": robot.L0}


def slide(recording: hopform.identify.Recording, mass: float, *more: str) -> Fit:
    """What moves as a slide of known mass; more: what is fitted beside spring and friction."""
    return fit_model("slide", recording, fitted=["k", "b", "F", "x_0", *more], known={"m": mass}, **ALONE)


@dataclasses.dataclass
class Count:
    """Intervals that hold the truth, of how many, by test and parameter;
    the slowest fit [s of CPU], fits that failed.
    """

    inside: dict[str, int] = dataclasses.field(default_factory=lambda: defaultdict(int))
    total: dict[str, int] = dataclasses.field(default_factory=lambda: defaultdict(int))
    without: int = 0
    """identifiable parameters without an interval"""
    slowest: float = 0.0
    slowest_of: str = ""
    failed: list[str] = dataclasses.field(default_factory=list)
    odd: list[str] = dataclasses.field(default_factory=list)
    """fits that say themselves that they are none"""

    @property
    def share(self) -> float:
        return sum(self.inside.values()) / max(sum(self.total.values()), 1)


def random_robot(rng: np.random.Generator) -> hopform.Robot:
    """A robot whose leg is a leg: it oscillates a few times and stops, its motor moves it;
    no friction of a kind at times.
    """

    def between(low: float, high: float) -> float:
        return float(math.exp(rng.uniform(math.log(low), math.log(high))))

    m_s, m_eff, omega = between(0.5, 10.0), between(1.0, 50.0), between(8.0, 35.0)
    k = m_s * omega**2
    b2 = 2.0 * m_s * omega * between(0.005, 0.15) * (rng.random() > 0.1)
    f2, f1 = between(0.1, 1.5) * (rng.random() > 0.15), between(0.1, 1.5) * (rng.random() > 0.15)
    # At its limit the motor holds its spring 2 to 6 cm away from rest.
    gamma2 = -k * between(0.02, 0.06) / 3.0
    f1 = min(f1, 0.3 * abs(gamma2) * 3.0 / m_eff)  # half of the current moves it too
    b1 = 2.0 * math.sqrt(k * m_eff) * between(0.05, 1.0)
    return hopform.Robot(
        m_eff=m_eff, m_s=m_s, k=k, L0=between(0.2, 0.6), b1=b1, b2=b2, f1=f1, f2=f2, gamma2=gamma2, u_max=3.0, g=9.81,
        impact_loss=float(rng.uniform(0.0, 0.2)),
    )  # fmt: skip


def score(count: Count, fit: Fit, robot: hopform.Robot, test: str) -> None:
    values = truth(robot, test)
    for each in fit.estimates:
        if each.own or each.name not in values:  # an offset or where a spring is slack, which are 0, are no parameters
            continue
        if not math.isfinite(each.high - each.low):
            count.without += each.method != "not identifiable"
            continue
        count.total[f"{test} {each.name}"] += 1
        count.inside[f"{test} {each.name}"] += each.low <= values[each.name] <= each.high


@mock.patch.object(alternatives, "allowing", lambda solution, estimates, spread, some: (tuple(estimates), spread, []))
def measure(seed: int, robots: int) -> Count:
    """The recordings of some random robots, each fitted by itself, with intervals by noise alone."""
    count = Count()
    estimation.student(0.95, 10.0)  # scipy is imported once, which is part of no fit
    of_scipy("optimize")
    for n in range(robots):
        rng = np.random.default_rng([seed, n])
        robot, rate = random_robot(rng), float(rng.uniform(200.0, 1000.0))
        own = int(rng.integers(2**31))
        jobs = {
            "drop": lambda r=robot, f=rate, s=own: fit_drop_test(
                record(r, "drop", rate=f, duration=1.6, hold=0.1, height=0.15, seed=s), known={"m_s": r.m_s},
                **ALONE,
            ),
            "decay": lambda r=robot, f=rate, s=own: slide(
                record(r, "decay", rate=f, duration=1.6, height=0.04, seed=s + 1), r.m_s,
            ),
            "step": lambda r=robot, f=rate, s=own: slide(
                record(r, "step", rate=f, duration=2.0, seed=s + 2), r.m_eff, "k_f",
            ),
            "counts": lambda r=robot, f=rate, s=own: slide(
                record(r, "decay", rate=f, duration=1.6, height=0.04, noise=QUIET, quantum=COUNT, seed=s + 4), r.m_s,
            ),
        }  # fmt: skip
        if n % 4 == 0:
            known = {"m_s": robot.m_s, "m_eff": robot.m_eff, "gamma2": robot.gamma2}
            jobs["free"] = lambda r=robot, f=rate, s=own, k=known: fit_drop_test(
                record(r, "free", rate=f, duration=1.6, hold=0.1, height=0.15, seed=s + 3), free=True, known=k,
                **ALONE,
            )  # fmt: skip
        for name, job in jobs.items():
            began = time.process_time()
            try:
                fit = job()
                score(count, fit, robot, name)
                count.odd += [f"robot {n}, {name}: {each}" for each in fit.warnings if "misses the recording" in each]
            except hopform.HopformError as error:
                count.failed.append(f"robot {n}, {name}: {error}")
            taken = time.process_time() - began
            if taken > count.slowest:
                count.slowest, count.slowest_of = taken, f"robot {n}, {name}"
    return count


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=20260801)
    chosen = parser.parse_args()
    count = measure(chosen.seed, chosen.count)
    for name, total in sorted(count.total.items()):
        print(f"{name:18} {count.inside[name]:5} of {total:5} inside, {100.0 * count.inside[name] / total:6.2f} %")
    print(f"pooled {100.0 * count.share:.2f} % over {chosen.count} robots; slowest fit {count.slowest:.2f} s "
          f"({count.slowest_of}); "
          f"{len(count.failed)} failed; {count.without} without an interval")  # fmt: skip
    print(*count.failed, *count.odd, sep="\n")
    return 0 if 0.92 <= count.share <= 0.97 and not count.failed else 1


if __name__ == "__main__":
    raise SystemExit(main())
