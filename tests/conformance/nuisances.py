"""How often intervals hold the truth where a nuisance is fitted.

A step response and a drop of each random robot, recorded by a simulator that shares nothing with hopform
(tests/oracle/recordings.c), with a lag of 0 to 5 ms, a gain of 0.97 to 1.03 or a clock that is
up to 2 % off. `python -m tests.conformance.nuisances --count 300` prints a line per nuisance.
"""

import argparse
import time
from collections import defaultdict
from dataclasses import dataclass, field, replace

import numpy as np

import hopform
from hopform.identify._drop import fit_drop_test
from hopform.identify._fits import Fit
from hopform.identify._joint import fit_robot
from hopform.identify._recordings import Column, Recording
from tests.conformance.confidence import TRUTH, random_robot
from tests.oracle.recordings import Rig, simulate

SEED = 20260920
NOISE, QUANTUM = 2e-5, 1.0 / 56000.0
RANGES = {"lag": (0.0, 0.005), "gain": (0.97, 1.03), "clock": (0.98, 1.02)}
NEUTRAL = {"delay": 0.0, "lag": 0.0, "gain": 1.0, "clock": 1.0}


def quick_robot(rng: np.random.Generator) -> hopform.Robot:
    """A random robot whose actuator shows milliseconds: on its spring it oscillates at 8 to 35 rad/s, as the body."""
    robot = random_robot(rng)
    omega, damping, way = float(rng.uniform(8.0, 35.0)), float(rng.uniform(0.05, 0.5)), float(rng.uniform(0.03, 0.08))
    m_eff = robot.k / omega**2
    return replace(
        robot, m_eff=m_eff, b1=2.0 * damping * m_eff * omega, gamma2=-robot.k * way / 3.0,
        f1=float(rng.uniform(0.02, 0.2)) * omega**2 * way,
    )  # fmt: skip


def measured(rig: Rig, u: np.ndarray, rate: float, place: str, rng: np.random.Generator) -> Recording:
    """A recording by the simulator, with noise and the encoder's quantum."""
    x = simulate(rig, u, rate) + NOISE * rng.standard_normal(u.size)
    columns = {place: Column(f"{place}_m", "length", 2, QUANTUM * np.round(x / QUANTUM))}
    if place == "x1":
        columns["current"] = Column("current_A", "current", 3, u)
    return Recording(place, np.arange(u.size) / rate, columns)


def step(robot: hopform.Robot, rate: float, rng: np.random.Generator, **sensor: float) -> Recording:
    """2.2 s: rest, then a current of up to 3 A either way, another one each 0.1 s."""
    levels = np.tile([3.0, -3.0, 1.5, -1.5, 0.0], 4)[rng.permutation(20)]
    u = np.concatenate([np.zeros(round(0.2 * rate)), np.repeat(levels, round(0.1 * rate))])
    rig = Rig(robot.m_eff, robot.k, robot.b1, robot.f1, gamma=-robot.gamma2, **sensor)
    return measured(rig, u, rate, "x1", rng)


def drop(robot: hopform.Robot, rate: float, rng: np.random.Generator, **sensor: float) -> Recording:
    """1.6 s: held for 0.1 s, then dropped from 15 cm."""
    rig = Rig(
        robot.m_s, robot.k, robot.b2, robot.f2, rest=robot.L0, drops=1.0, g=robot.g, loss=robot.impact_loss,
        start=robot.L0 + 0.15, held=0.1, **sensor,
    )  # fmt: skip
    return measured(rig, np.zeros(round(1.6 * rate)), rate, "x2", rng)


def fitted(nuisance: str, robot: hopform.Robot, recording: Recording, **options) -> Fit:
    """A step response for a lag, scaled by m_eff; a drop of a known body on a known spring for gain and clock,
    which takes two known times: that of the fall and that of the spring.
    """
    if nuisance == "lag":
        return fit_robot(steps=recording, known={"m_eff": robot.m_eff}, compare=False, holdout=False, **options)
    known = {"m_s": robot.m_s, "k": robot.k}
    return fit_drop_test(recording, known=known, compare=False, holdout=False, **options)


@dataclass
class Count:
    """Per nuisance: intervals that hold the truth, of how many; the slowest fit [s]."""

    inside: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    total: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    slowest: float = 0.0
    notes: list[str] = field(default_factory=list)

    @property
    def share(self) -> float:
        """Of all intervals together."""
        return sum(self.inside.values()) / max(sum(self.total.values()), 1)


def score(count: Count, nuisance: str, fit: Fit, robot: hopform.Robot, value: float) -> list[str]:
    """Count the intervals that hold the truth; the parameters whose do not."""
    missed = []
    for each in fit.estimates:
        of_sensor = each.name.startswith(nuisance)
        name = TRUTH.get(each.name, each.name)
        if (each.own and not of_sensor) or name is None or not each.low > -np.inf:
            continue
        held = each.low <= (value if of_sensor else getattr(robot, name)) <= each.high
        count.total[nuisance] += 1
        count.inside[nuisance] += held
        missed += [] if held else [each.name]
    return missed


def measure(seed: int, robots: int) -> Count:
    """Each nuisance on some random robots."""
    count = Count()
    for n in range(robots):
        rng = np.random.default_rng([seed, n])
        robot, rate = quick_robot(rng), float(rng.integers(200, 1000))
        for nuisance, (low, high) in RANGES.items():
            value = float(rng.uniform(low, high))
            make = step if nuisance == "lag" else drop
            recording = make(robot, rate, rng, **(NEUTRAL | {nuisance: value}))
            began = time.process_time()
            fit = fitted(nuisance, robot, recording, nuisances=(nuisance,))
            count.slowest = max(count.slowest, time.process_time() - began)
            missed = score(count, nuisance, fit, robot, value)
            if missed:
                outside = f"outside {', '.join(missed)}, rms {1e3 * fit.rms:.3g} mm"
                count.notes.append(f"robot {n}, {nuisance} {value:.4g}: {outside}")
    return count


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--verbose", action="store_true")
    chosen = parser.parse_args()
    count = measure(chosen.seed, chosen.count)
    for name, total in count.total.items():
        print(f"{name:6} intervals {100.0 * count.inside[name] / total:6.2f} % of {total}")
    print(f"pooled {100.0 * count.share:.2f} %; slowest fit with diagnoses {count.slowest:.2f} s")
    if chosen.verbose:
        print(*count.notes, sep="\n")
    each = [count.inside[name] / count.total[name] for name in RANGES]
    return 0 if 0.92 <= count.share <= 0.97 and min(each) >= 0.9 else 1


if __name__ == "__main__":
    raise SystemExit(main())
