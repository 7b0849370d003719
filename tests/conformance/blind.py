"""Blind fits: recordings of rigs that do what no element of the model says, at rates, currents and noises of their own.

Each recording is made by a simulator that shares nothing with hopform (tests/oracle/recordings.c), of a rig with one
effect, all drawn by a seed. A fit knows the effect of none. `python -m tests.conformance.blind --count 5` prints a
line per kind of recording and effect.

| column | of the fits in a cell |
|---|---|
| without | share that gives no interval |
| held | intervals given that hold the truth, of how many |
| gross | fits with an interval off by over two half widths, of which nothing is said |
| right, wrong | fits that name a cause that is there, one that is not there |
| possible | causes that are named as possible, the nearest first |

Rates are 100 Hz to 1 kHz, a current holds for 0.15 to 0.6 s, sensors have noise or only counts. With `--repeats 3`
three recordings of one rig are fitted together.
"""

import argparse
import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np

import hopform
from hopform import identify
from hopform.identify import Fit, Recording
from hopform.identify._recordings import parse_recording
from tests.oracle.recordings import Rig, simulate

SEED = 20261129
Draw = np.random.Generator


@dataclass(frozen=True)
class Rigged:
    """A rig and its logger: what moves, by which current, and what the logger makes of it.

    counts: steps of the sensor per rad, or per m; 0 for none. noise [rad, m] of the sensor. noise_of_current [A] of the
    logged current. drifts [rad, m]: by how much the sensor is off at the end. bent [1/m^2]: of a lens, x (1 + bent x^2)
    about the middle. gap: first and number of the samples that are lost, of which the times do not tell.
    """

    kind: str
    rig: Rig
    u: np.ndarray
    rate: float
    noise: float
    counts: float = 0.0
    noise_of_current: float = 0.0
    drifts: float = 0.0
    bent: float = 0.0
    gap: tuple[int, int] | None = None


Effect = Callable[[Rigged, Draw], Rigged]


def _between(rng: Draw, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def _force(of: Rigged) -> float:
    """The largest force of drive or spring."""
    return max(float(np.abs(of.rig.gamma * of.u).max(initial=0.0)), abs(of.rig.k * (of.rig.start - of.rig.rest)))


def _motion(of: Rigged) -> tuple[float, float]:
    """How far and how fast the rig moves without an effect."""
    x = simulate(of.rig, of.u, of.rate)
    return float(np.ptp(x)), float(np.abs(np.diff(x)).max()) * of.rate


def _rig(**sizes: Callable[[Rigged, Draw], float]) -> Effect:
    return lambda of, rng: replace(of, rig=replace(of.rig, **{name: size(of, rng) for name, size in sizes.items()}))


def _link(of: Rigged, rng: Draw) -> Rigged:
    """2 to 50 % of the inertia behind a spring of 8 to 60 Hz, the sensor on either side."""
    share, omega = _between(rng, 0.02, 0.5), 2.0 * math.pi * _between(rng, 8.0, 60.0)
    link = share * of.rig.mass
    stiff = link * omega**2
    return replace(of, rig=replace(
        of.rig, mass=of.rig.mass - link, link=link, link_k=stiff, link_b=0.04 * stiff / omega,
        at_link=float(rng.integers(2)),
    ))  # fmt: skip


def _lost(of: Rigged, rng: Draw) -> Rigged:
    """Lost samples, 20 to 60 ms, of which the times do not tell."""
    count = max(round(_between(rng, 0.02, 0.06) * of.rate), 3)
    return replace(of, gap=(int(of.u.size * rng.uniform(0.15, 0.5)), count))


def _cut(of: Rigged, rng: Draw) -> Rigged:
    return replace(of, u=of.u[: max(round(_between(rng, 0.25, 0.6) * of.rate), 40)])


def _stribeck(of: Rigged, rng: Draw) -> Rigged:
    speed = _motion(of)[1] * _between(rng, 0.02, 0.15)
    return replace(of, rig=replace(of.rig, stribeck=_between(rng, 0.05, 1.0), speed=speed))


def _drag(of: Rigged, rng: Draw) -> Rigged:
    speed = _motion(of)[1]
    whole = of.rig.b + of.rig.mass * of.rig.f / speed
    return replace(of, rig=replace(of.rig, drag=_between(rng, 0.03, 0.6) * whole / speed))


EFFECTS: Mapping[str, Effect] = {
    "sound": lambda of, _: of,
    "short": _cut,
    "delay": _rig(delay=lambda _, rng: _between(rng, 1e-3, 8e-3)),
    "lag": _rig(lag=lambda _, rng: _between(rng, 5e-4, 8e-3)),
    "link": _link,
    "ripple": _rig(
        ripple=lambda of, rng: _between(rng, 0.003, 0.1) * _force(of),
        pitch=lambda of, rng: _motion(of)[0] / rng.uniform(2.0, 9.0),
    ),
    "Stribeck": _stribeck,
    "drag": _drag,
    "load": _rig(drift=lambda of, rng: _between(rng, 0.002, 0.1) * _force(of)),
    "loaded": _rig(loaded=lambda _, rng: _between(rng, 0.005, 0.15)),
    "hardening": _rig(hard=lambda of, rng: _between(rng, 0.005, 0.3) / (0.5 * _motion(of)[0]) ** 2),
    "play": _rig(play=lambda of, rng: _between(rng, 0.0005, 0.02) * _motion(of)[0]),
    "drift": lambda of, rng: replace(of, drifts=_between(rng, 0.0003, 0.03) * _motion(of)[0] * rng.choice([-1.0, 1.0])),
    "current noise": lambda of, rng: replace(
        of, noise_of_current=_between(rng, 0.002, 0.08) * float(np.abs(of.u).max())
    ),
    "lens": lambda of, rng: replace(of, bent=_between(rng, 0.001, 0.1) / _motion(of)[0] ** 2),
    "gap": _lost,
}

CELLS: Mapping[str, tuple[str, ...]] = {
    "held": ("sound", "short", "delay", "lag", "link", "ripple", "Stribeck", "drag", "loaded", "hardening", "play",
             "drift", "current noise", "gap"),
    "joint": ("sound", "short", "lag", "link", "ripple", "Stribeck", "drag", "load", "loaded", "play", "drift",
              "current noise", "gap"),
    "decay": ("sound", "short", "link", "ripple", "Stribeck", "drag", "loaded", "hardening", "play", "drift", "gap"),
    "drop": ("sound", "lag", "drift", "lens", "gap"),
}  # fmt: skip
RIGHT: Mapping[str, tuple[str, ...]] = {
    "delay": ("delay",), "lag": ("lag", "delay"), "Stribeck": ("Stribeck",), "drag": ("drag",), "load": ("drift",),
    "play": ("play",), "drift": ("sensor drift",), "current noise": ("current noise",), "lens": ("lens",),
    "gap": ("gap",), "link": ("link",), "ripple": ("ripple",), "loaded": ("loaded",), "hardening": ("hardening",),
}  # fmt: skip
"""Names that are true of an effect; any other is wrong."""


def drawn(kind: str, effect: str, number: int, seed: int = SEED) -> tuple[Rigged, Draw]:
    """A rig of a cell, and the stream of its noise."""
    rng = np.random.default_rng([seed, [*CELLS].index(kind), [*EFFECTS].index(effect), number])
    rate = float(rng.choice([100.0, 200.0, 250.0, 400.0, 1000.0]))
    rate = max(rate, 200.0) if kind == "drop" else rate
    if kind == "drop":
        mass, sag = _between(rng, 1.0, 8.0), rng.uniform(0.008, 0.02)
        k = mass * 9.81 / sag
        rig = Rig(mass, k, 2.0 * rng.uniform(0.02, 0.1) * math.sqrt(k * mass), rng.uniform(0.1, 1.0), drops=1.0, g=9.81,
                  rest=rng.uniform(0.25, 0.5), loss=rng.uniform(0.0, 0.1), held=0.1)  # fmt: skip
        rig = replace(rig, start=rig.rest + rng.uniform(0.08, 0.25))
        of = Rigged(kind, rig, np.zeros(round(rng.uniform(1.2, 2.5) * rate)), rate, _between(rng, 3e-5, 3e-4))
        return EFFECTS[effect](of, rng), rng
    J, omega, zeta = _between(rng, 0.005, 0.1), rng.uniform(6.0, 25.0), rng.uniform(0.03, 0.4)
    way, length = rng.uniform(0.15, 0.6), rng.uniform(2.0, 5.0)
    k, b = J * omega**2, 2.0 * zeta * J * omega
    f = rng.uniform(0.02, 0.12) * omega**2 * way
    count = round(length * rate)
    u = np.zeros(count)
    if kind == "decay":
        rig = Rig(J, k, 0.4 * b, 0.3 * f, start=way, held=0.1)
    else:
        most, place = rng.uniform(0.5, 8.0), round(0.2 * rate)
        while place < count:
            hold = max(round(rng.uniform(0.15, 0.6) * rate), 1)
            u[place : place + hold] = most * rng.choice([-1.0, -0.6, 0.0, 0.4, 1.0])
            place += hold
        gamma = k * way / most
        rig = Rig(J, k if kind == "held" else 0.0, b, f, gamma=gamma)
    counted = rng.random() < 0.4
    counts = _between(rng, 4096.0, 65536.0) / (2.0 * math.pi) if counted else 0.0
    of = Rigged(kind, rig, u, rate, 1e-5 if counted else _between(rng, 5e-5, 1e-3), counts)
    return EFFECTS[effect](of, rng), rng


def recorded(of: Rigged, rng: Draw) -> Recording:
    """What the logger of a rig writes."""
    x = simulate(of.rig, of.u, of.rate)
    x = x + of.drifts * np.linspace(0.0, 1.0, x.size)
    middle = 0.5 * (float(x.max()) + float(x.min()))
    x = x + of.bent * (x - middle) ** 3 + of.noise * rng.standard_normal(x.size)
    x = np.round(x * of.counts) / of.counts if of.counts else x
    u = of.u + of.noise_of_current * rng.standard_normal(x.size)
    if of.gap is not None:
        begin, count = of.gap
        x, u = np.delete(x, np.s_[begin : begin + count]), np.delete(u, np.s_[begin : begin + count])
    t = np.arange(x.size) / of.rate
    if of.kind in ("decay", "drop"):
        head, columns = f"time_s,{'x2_m' if of.kind == 'drop' else 'q_rad'}", [t, x]
    else:
        head, columns = "time_s,q_rad,i_A", [t, x, u]
    rows = np.stack(columns, axis=1).tolist()
    return parse_recording("\n".join([head, *(",".join(map(repr, row)) for row in rows)]), "log.csv")


@cache
def _joint() -> Any:
    return hopform.load_solver("joint")


def fitted(of: Rigged, recordings: Sequence[Recording], **options: Any) -> tuple[Fit, dict[str, float]]:
    """The fit of a rig's recordings, and the truth of what it fits."""
    rig = of.rig
    if of.kind == "drop":
        truth = {"k": rig.k, "b2": rig.b, "f2": rig.f, "length": rig.rest, "impact_loss": rig.loss}
        return identify.fit_drop_test([*recordings], known={"m_s": rig.mass}, **options), truth
    mass = rig.mass + rig.link
    truth = {"J": mass, "k": rig.k, "b": rig.b, "F_p": rig.mass * rig.f, "q_0": 0.0}
    known: dict[str, float | str] = {"F_m": "F_p", "k_t": rig.gamma}
    if of.kind == "decay":
        known = {"F_m": "F_p", "k": rig.k}
    elif of.kind == "joint":
        known |= {"k": 0.0}
        del truth["q_0"]
    names = [name for name in truth if name not in known]
    return identify.fit(_joint(), [*recordings], fitted=names, known=known, **options), truth


@dataclass
class Cell:
    """The fits of a cell."""

    fits: int = 0
    without: int = 0
    total: int = 0
    inside: int = 0
    gross: list[int] = field(default_factory=list[int])
    names: Counter[str] = field(default_factory=Counter[str])
    possible: Counter[str] = field(default_factory=Counter[str])
    failed: list[str] = field(default_factory=list[str])
    missed: list[str] = field(default_factory=list[str])
    seconds: float = 0.0

    def score(self, fit: Fit, truth: Mapping[str, float], number: int) -> None:
        given = [(e, truth[e.name]) for e in fit.estimates if e.name in truth and math.isfinite(e.high - e.low)]
        self.fits += 1
        self.without += not given
        self.total += len(given)
        self.inside += sum(e.low <= true <= e.high for e, true in given)
        self.missed += [f"{number}:{e.name} {true:.4g} not in {e.low:.4g}..{e.high:.4g} {e.method}"
                        for e, true in given if not e.low <= true <= e.high]  # fmt: skip
        if any(abs(true - 0.5 * (e.low + e.high)) > e.high - e.low for e, true in given):
            self.gross.append(number)
        named = [each.name for each in fit.diagnoses if not each.possible]
        self.names[named[0] if named else "-"] += 1
        may = [each.name for each in fit.diagnoses if each.possible]
        self.possible[may[0] if may else "-"] += 1

    def right(self, effect: str) -> int:
        """Fits that name the effect."""
        return sum(n for name, n in self.names.items() if name in RIGHT.get(effect, ()))

    def wrong(self, effect: str) -> int:
        """Fits that name a cause that is not there."""
        return sum(n for name, n in self.names.items() if name not in ("-", *RIGHT.get(effect, ())))


def measure(kind: str, effect: str, numbers: Sequence[int], seed: int = SEED, repeats: int = 1, **options: Any) -> Cell:
    """The fits of a cell: rigs are drawn by seed, kind, effect and number."""
    cell = Cell()
    for n in numbers:
        of, rng = drawn(kind, effect, n, seed)
        recordings = [recorded(of, rng) for _ in range(repeats)]
        began = time.process_time()
        try:
            cell.score(*fitted(of, recordings, **options), n)
        except hopform.HopformError as error:
            cell.failed.append(f"{n}: {error}")
        cell.seconds += time.process_time() - began
    return cell


def line(kind: str, effect: str, cell: Cell) -> str:
    """A cell as a row of a table in Markdown."""
    may = ", ".join(f"{name} {n}" for name, n in cell.possible.most_common(3))
    named = ", ".join(f"{name} {n}" for name, n in cell.names.most_common(3))
    numbers = f"{cell.fits:3} | {cell.without:3} | {cell.inside:3} of {cell.total:3} | {len(cell.gross):2}"
    return f"| {kind:5} | {effect:13} | {numbers} | {cell.right(effect):2} | {cell.wrong(effect):2} | {named} | {may} |"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=4)
    parser.add_argument("--first", type=int, default=0, help="number of the first rig of each cell")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--only", default="", help="a kind, an effect or kind:effect")
    parser.add_argument("--verbose", action="store_true")
    chosen = parser.parse_args()
    options = {"compare": False, "holdout": False}
    print("| kind | effect | fits | without | held | gross | right | wrong | names | possible |")
    print("|---|---|--:|--:|--:|--:|--:|--:|---|---|")
    every = Cell()
    right = wrong = 0
    for kind, effects in CELLS.items():
        for effect in effects:
            if chosen.only not in ("", kind, effect, f"{kind}:{effect}"):
                continue
            numbers = range(chosen.first, chosen.first + chosen.count)
            cell = measure(kind, effect, numbers, chosen.seed, chosen.repeats, **options)
            print(line(kind, effect, cell), flush=True)
            if chosen.verbose:
                print(*(f"    {each}" for each in (*cell.missed, *cell.failed)), sep="\n")
            every.fits += cell.fits
            every.without += cell.without
            every.total += cell.total
            every.inside += cell.inside
            every.gross += cell.gross
            every.failed += cell.failed
            every.seconds += cell.seconds
            right, wrong = right + cell.right(effect), wrong + cell.wrong(effect)
    print(f"{every.fits} fits, {every.without} without an interval, {every.inside} of {every.total} hold, "
          f"{len(every.gross)} gross and silent; names {right} right, {wrong} wrong; {len(every.failed)} refused; "
          f"{every.seconds:.0f} s")  # fmt: skip
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
