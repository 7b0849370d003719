"""Faults that nobody announced: how often intervals hold the truth, what is named, what is said of them.

Each recording is made by a simulator that shares nothing with hopform (tests/oracle/recordings.c), of a random robot
with a random size of one fault, all drawn by a seed. `python -m tests.conformance.faults --count 100` prints a line per
cell: a kind of recording with a fault.

| column | of the fits in a cell |
|---|---|
| without | share that gives no interval |
| held | share of the intervals given that hold the truth |
| gross | share of the fits with an interval off by over two half widths, of which nothing is said |
| names | causes that are named first, and how often |
"""

import argparse
import math
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import hopform
from hopform.identify._fits import Fit
from hopform.identify._joint import fit_robot
from hopform.identify._recordings import Column, Recording
from tests.conformance.confidence import TRUTH
from tests.conformance.nuisances import quick_robot
from tests.oracle.recordings import Rig, simulate

SEED = 20261128
QUANTUM = 1.0 / 56000.0
Draw = np.random.Generator


@dataclass(frozen=True)
class Fault:
    """What is wrong with a recording: of the rig (fields of `Rig`), of the logger, or of what is taken as known."""

    rig: Mapping[str, float] = field(default_factory=dict[str, float])
    noise_of_current: float = 0.0
    wander: float = 0.0
    """[m] standard deviation of a slow disturbance of the position"""
    known_by: float = 1.0
    """factor of the stiffness that is taken as known; beside the mass if it is not 1"""
    both: bool = False
    """stiffness and mass are known"""
    one_way: bool = False
    duration: float = 2.2


def _between(low: float, high: float) -> Callable[[Draw], float]:
    return lambda rng: float(rng.uniform(low, high))


def _of_rig(name: str, low: float, high: float) -> Callable[[Draw], Fault]:
    return lambda rng: Fault({name: float(rng.uniform(low, high))})


def _known(rng: Draw) -> Fault:
    return Fault(known_by=1.0 + 0.05 * float(rng.choice([-1.0, 1.0])), both=True)


FAULTS: Mapping[str, Callable[[Draw], Fault]] = {
    "sound": lambda _: Fault(),
    "short delay": _of_rig("delay", 1e-4, 1e-3),
    "delay": _of_rig("delay", 1e-3, 1e-2),
    "lag": _of_rig("lag", 5e-4, 5e-3),
    "clock": lambda rng: Fault({"clock": 1.0 + float(rng.choice([-1.0, 1.0]) * rng.uniform(0.005, 0.02))}, both=True),
    "gain": lambda rng: Fault({"gain": 1.0 + float(rng.choice([-1.0, 1.0]) * rng.uniform(0.005, 0.03))}, both=True),
    "known value": _known,
    "noise of current": lambda _: Fault(noise_of_current=0.02),
    "wander": lambda _: Fault(wander=1e-4),
    "drift": _of_rig("drift", 0.2, 1.0),
    "play": _of_rig("play", 1e-4, 1e-3),
    "Stribeck": lambda rng: Fault({"stribeck": float(rng.uniform(0.2, 0.6)), "speed": float(rng.uniform(0.02, 0.1))}),
    "drag": _of_rig("drag", 0.05, 0.3),
    "stop": _of_rig("stop", 0.3, 0.8),
    "one way": lambda _: Fault(one_way=True),
    "short": lambda _: Fault(duration=0.5),
}
"""Sizes of drift, drag and stop are shares: of the largest force per second, of the viscous force at the speed of the
motion (drag per unit of it), of the largest way."""

CELLS: Mapping[str, tuple[str, ...]] = {
    "step": ("sound", "short delay", "delay", "lag", "known value", "noise of current", "wander", "drift", "play",
             "Stribeck", "drag", "stop", "one way", "short"),
    "air": ("sound", "short delay", "delay", "noise of current", "wander", "drift", "play", "Stribeck", "one way",
            "short"),
    "decay": ("sound", "lag", "wander", "drag", "play", "Stribeck", "known value", "short"),
    "drop": ("sound", "lag", "clock", "gain", "known value", "wander"),
}  # fmt: skip
RIGHT: Mapping[str, tuple[str, ...]] = {
    "short delay": ("delay",), "delay": ("delay",), "lag": ("lag", "delay"), "clock": ("clock",), "gain": ("gain",),
    "known value": ("known value",), "drift": ("drift",), "play": ("play",), "Stribeck": ("Stribeck",),
    "drag": ("drag",), "stop": ("stop",),
}  # fmt: skip
"""Names that are true of a fault; any other is wrong."""


def _currents(rng: Draw, rate: float, fault: Fault) -> np.ndarray:
    """Rest for 0.2 s, then a current of up to 3 A, another one each 0.1 s."""
    count = max(math.ceil((fault.duration - 0.2) / 0.1), 3)
    levels = np.resize([3.0, -3.0, 1.5, -1.5, 0.0], 20)[rng.permutation(20)][np.arange(count) % 20]
    levels = np.abs(levels) if fault.one_way else levels
    u = np.concatenate([np.zeros(round(0.2 * rate)), np.repeat(levels, round(0.1 * rate))])
    return u[: round(fault.duration * rate)]


def _sized(rig: Rig, kind: str, fault: Fault, way: float, speed: float, force: float) -> Rig:
    """The rig with its fault, whose size is a share of the motion's."""
    changed = dict(fault.rig)
    if "drift" in changed:
        changed["drift"] *= 0.1 * force
    if "drag" in changed:
        changed["drag"] *= (rig.b + rig.mass * rig.f / speed) / speed
    if "stop" in changed:
        changed["stop"] *= way
    if kind == "decay" and "stribeck" in changed:
        changed["speed"] = 0.15 * speed
    return replace(rig, **changed)


def recorded(kind: str, robot: hopform.Robot, fault: Fault, rate: float, noise: float, rng: Draw) -> Recording:
    """A recording of a robot with a fault."""
    u = np.zeros(round(min(fault.duration, 1.6) * rate))
    body = Rig(robot.m_s, robot.k, robot.b2, robot.f2)
    place, omega = "x2", math.sqrt(robot.k / robot.m_s)
    if kind == "drop":
        rig = replace(body, rest=robot.L0, drops=1.0, g=robot.g, loss=robot.impact_loss, start=robot.L0 + 0.15,
                      held=0.1)  # fmt: skip
        way = speed = force = 1.0
    elif kind == "decay":
        rig, way, speed, force = replace(body, start=-0.04), 0.04, 0.04 * omega, robot.k * 0.04
    else:
        u, place, force = _currents(rng, rate, fault), "x1", 3.0 * abs(robot.gamma2)
        rig = Rig(robot.m_eff, robot.k if kind == "step" else 0.0, robot.b1, robot.f1, gamma=-robot.gamma2)
        plain = simulate(rig, u, rate)
        way, speed = float(plain.max()), float(np.abs(np.diff(plain)).max()) * rate
    x = simulate(_sized(rig, kind, fault, way, speed, force), u, rate)
    if fault.wander:
        x = x + fault.wander * _wander(u.size, rate, rng)
    x = QUANTUM * np.round((x + noise * rng.standard_normal(u.size)) / QUANTUM)
    columns = {place: Column(f"{place}_m", "length", 2, x)}
    if place == "x1":
        seen = u + fault.noise_of_current * rng.standard_normal(u.size)
        columns["current"] = Column("current_A", "current", 3, seen)
    return Recording("log.csv", np.arange(u.size) / rate, columns)


def _wander(count: int, rate: float, rng: Draw) -> np.ndarray:
    """A process of Ornstein and Uhlenbeck of variance 1 and a memory of 0.1 s."""
    kept, value, found = math.exp(-10.0 / rate), float(rng.standard_normal()), np.empty(count)
    for n, each in enumerate(rng.standard_normal(count).tolist()):
        value = kept * value + math.sqrt(1.0 - kept * kept) * each
        found[n] = value
    return found


def fitted(kind: str, robot: hopform.Robot, fault: Fault, recording: Recording, **options: Any) -> Fit:
    known = {"m_eff": robot.m_eff} if kind in ("step", "air") else {"m_s": robot.m_s}
    if fault.both:
        known["k"] = robot.k * fault.known_by
    options = {"compare": False, "holdout": False} | options
    role = {"step": "steps", "air": "air", "decay": "decays", "drop": "drops"}[kind]
    return fit_robot(**{role: recording}, known=known, **options)


@dataclass
class Cell:
    """The fits of a cell."""

    fits: int = 0
    without: int = 0
    total: int = 0
    inside: int = 0
    gross: int = 0
    names: Counter[str] = field(default_factory=Counter[str])
    failed: list[str] = field(default_factory=list[str])
    seconds: float = 0.0

    def score(self, fit: Fit, robot: hopform.Robot) -> None:
        shared = [e for e in fit.estimates if not e.own and e.name in TRUTH | robot.parameters._asdict()]
        given = [(e, _truth(robot, e.name)) for e in shared if math.isfinite(e.high - e.low)]
        self.fits += 1
        self.without += not given
        self.total += len(given)
        self.inside += sum(e.low <= true <= e.high for e, true in given)
        off = any(abs(true - 0.5 * (e.low + e.high)) > e.high - e.low for e, true in given)
        named = [each.name for each in fit.diagnoses if not each.possible]
        self.gross += off and not named and not any("white" in each for each in fit.warnings)
        self.names[named[0] if named else "-"] += 1

    def wrong(self, fault: str) -> int:
        """Fits that name a cause that is not there."""
        return sum(n for name, n in self.names.items() if name not in ("-", *RIGHT.get(fault, ())))


def _truth(robot: hopform.Robot, name: str) -> float:
    of = TRUTH.get(name, name)
    return 0.0 if of is None else float(getattr(robot, of))


def drawn(seed: int, kind: str, name: str, number: int) -> tuple[hopform.Robot, Fault, Recording]:
    """A robot, the size of its fault, and their recording, drawn by seed, kind, fault and number."""
    rng = np.random.default_rng([seed, [*CELLS].index(kind), [*FAULTS].index(name), number])
    robot, rate, noise = quick_robot(rng), float(rng.integers(200, 1000)), 10.0 ** rng.uniform(-4.7, -3.7)
    fault = FAULTS[name](rng)
    return robot, fault, recorded(kind, robot, fault, rate, noise, rng)


def measure(seed: int, count: int, cells: Mapping[str, tuple[str, ...]] = CELLS) -> dict[tuple[str, str], Cell]:
    """Each cell's fits of so many robots."""
    found = dict[tuple[str, str], Cell]()
    for kind, faults in cells.items():
        for name in faults:
            cell = found[kind, name] = Cell()
            for n in range(count):
                robot, fault, recording = drawn(seed, kind, name, n)
                began = time.process_time()
                try:
                    cell.score(fitted(kind, robot, fault, recording), robot)
                except hopform.HopformError as error:
                    cell.failed.append(f"{kind}, {name}, {n}: {error}")
                cell.seconds = max(cell.seconds, time.process_time() - began)
    return found


def line(kind: str, fault: str, cell: Cell) -> str:
    """A cell as a row of a table in Markdown."""
    many = max(cell.fits, 1)
    names = ", ".join(f"{name} {n}" for name, n in cell.names.most_common())
    shares = (cell.without / many, cell.inside / max(cell.total, 1), cell.gross / many)
    numbers = " | ".join(f"{100.0 * share:5.1f}" for share in shares)
    return f"| {kind:5} | {fault:16} | {numbers} | {cell.wrong(fault):3} | {len(cell.failed):2} | {names} |"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--only", default="", help="a kind or kind:fault")
    parser.add_argument("--verbose", action="store_true")
    chosen = parser.parse_args()
    print("| kind  | fault            | without | held | gross | wrong | refused | names |")
    print("|---|---|---|---|---|---|---|---|")
    slowest = 0.0
    for kind, faults in CELLS.items():
        for fault in faults:
            if chosen.only not in (f"{kind}:{fault}"[: len(chosen.only)], fault):
                continue
            cell = measure(chosen.seed, chosen.count, {kind: (fault,)})[kind, fault]
            slowest = max(slowest, cell.seconds)
            print(line(kind, fault, cell), flush=True)
            if chosen.verbose and cell.failed:
                print(*cell.failed, sep="\n")
    print(f"slowest fit {slowest:.2f} s")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
