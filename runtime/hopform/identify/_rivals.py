"""What no element of a model says, as further columns of a fit along its motion. A cause is named only where it stands
out from these.

| rival | columns |
|---|---|
| friction by load, a spring that hardens | a force along the motion, as of `_causes` |
| torque ripple | forces sin and cos of the place, of the pitch that explains most |
| a link that bends | what an oscillator shows that the motion drives, and its reaction, of the frequency that explains most |
| drift of the sensor | slow changes of the position, of each recording |
| lens | the cube of the place about the middle |
| lost samples | another place and velocity from a jump of the data on |

The response to a force is that of the linear equation between the turns of the motion: while it is at rest nothing
moves, and where the velocity changes its sign its change is scaled by the ratio of the accelerations.
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from hopform.identify._estimation import Solution
from hopform.identify._motion import Array, Values, of_scipy
from hopform.identify._recordings import noise_of, quantum_of
from hopform.identify._rigs import Along, Experiment


class Rival(NamedTuple):
    """A rival: its name, a number that says which (a frequency [Hz], a pitch, a time), and its columns, a row for each
    sample of all recordings.
    """

    name: str
    number: float
    columns: Array


class Jump(NamedTuple):
    """Where a recording jumps: the sample after which it does, the times [s] on both sides, by how much [m] the position
    moves there beyond what it does around it, and by how much [m/s] the velocity changes, 0 where that is not the jump.
    """

    sample: int
    before: float
    after: float
    size: float
    speed: float = 0.0


def rivals_of(solution: Solution) -> Iterator[list[Rival]]:
    """The rivals at a minimum, each as what its number may be."""
    several = solution.experiments
    motions = [along_of(each, solution.values) for each in several]
    yield [Rival("sensor drift", 0.0, _drifts(several))]
    if all(each.quantity == "x2" for each in several):
        yield [Rival("lens", 0.0, _stacked([_cubed(each) for each in several]))]
    jumps = [(n, jump) for n, each in enumerate(several) for jump in jumps_of(each.time, each.measured)]
    if all(at is None or each.kind == "ground" for at, each in zip(motions, several, strict=True)):
        return
    carried = [(each, at) for each, at in zip(several, motions, strict=True) if at is not None]
    if len(carried) < len(several):
        return
    if jumps:
        yield [Rival("gap", jump.before, _kicked(carried, n, jump)) for n, jump in jumps[:_MOST_JUMPS]]
    yield _ripples(carried)
    yield _links(carried)


_MOST_JUMPS = 3


def along_of(experiment: Experiment, values: Values) -> Along | None:
    """The fitted motion as a force along it sees it; None where the rig has no response to forces."""
    seen = list[Along]()

    def look(at: Along) -> Array:
        seen.append(at)
        return np.zeros_like(at.t)

    experiment.response_to(values, look, 1.0)
    return seen[-1] if seen else None


def seen_at(experiment: Experiment, at: Along, columns: Array) -> Array:
    """What is known at the times of a motion, at a recording's samples."""
    n = np.clip(np.searchsorted(at.t, experiment.time), 1, at.t.size - 1)
    share = (experiment.time - at.t[n - 1]) / np.maximum(at.t[n] - at.t[n - 1], 1e-300)
    share = share.reshape(-1, *[1] * (columns.ndim - 1))
    return np.asarray(columns[n - 1] + share * (columns[n] - columns[n - 1]))


def _stacked(parts: Sequence[Array]) -> Array:
    return np.concatenate([part if part.ndim > 1 else part[:, np.newaxis] for part in parts])


def _blocks(several: Sequence[Experiment], number: int, columns: Array) -> Array:
    """Columns of one recording among the samples of all."""
    parts = [np.zeros((each.time.size, columns.shape[1])) for each in several]
    parts[number] = columns
    return np.concatenate(parts)


# ---- of the sensor ----


def slow(time: Array) -> Array:
    """Slow changes over a recording: a line and two half waves."""
    share = (time - time[0]) / max(float(time[-1] - time[0]), 1e-9)
    return np.stack([share, np.cos(math.pi * share), np.cos(2.0 * math.pi * share)], axis=1)


def behind_play(x: Array, width: float) -> Array:
    """What a sensor shows that follows a motion through a play of a width [m]."""
    positions, shown = np.empty(x.size), float(x[0])
    for n, place in enumerate(x.tolist()):
        shown = min(max(shown, place - 0.5 * width), place + 0.5 * width)
        positions[n] = shown
    return positions


def _drifts(several: Sequence[Experiment]) -> Array:
    return np.hstack([_blocks(several, n, slow(each.time)) for n, each in enumerate(several)])


def _cubed(experiment: Experiment) -> Array:
    x = experiment.measured
    middle = 0.5 * (float(x.max()) + float(x.min()))
    return np.asarray((x - middle) ** 3 / max(float(np.ptp(x)), 1e-300) ** 2)


_JUMP = 12.0
"""Times its noise, and times what the usual step of velocity makes, that a position jumps where samples are lost."""


def jumps_of(time: Array, x: Array) -> list[Jump]:
    """Where a position goes on elsewhere, the largest jump first, then where its velocity is another one: no motion
    takes such a step from one sample to the next, and the samples around it are on smooth curves either side.
    """
    if x.size < _FEWEST:
        return []
    usual_step = float(np.median(np.diff(time)))
    step = np.diff(x) / np.maximum(np.diff(time), 1e-12) * usual_step
    least = max(noise_of(x), quantum_of(x), 1e-15)
    near = np.stack([step[n : step.size - 6 + n] for n in (0, 1, 2, 4, 5, 6)], axis=1)
    middle, spread = np.median(near, axis=1), np.ptp(near, axis=1)
    off = step[3:-3] - middle
    far = np.flatnonzero(np.abs(off) > _JUMP * least + 2.0 * np.maximum(spread, float(np.median(spread)))) + 3
    jumps = [Jump(n, float(time[n]), float(time[n + 1]), float(off[n - 3])) for n in far.tolist()]
    before, after = np.mean(near[:, :3], axis=1), np.mean(near[:, 3:], axis=1)
    change = np.asarray(after - before, dtype=np.float64)
    bend = np.flatnonzero(np.abs(change) > _JUMP * least + _KINK * float(np.percentile(np.abs(change), 98.0)))
    if bend.size and not jumps:
        n = int(bend[np.abs(change[bend]).argmax()]) + 3
        jumps = [Jump(n, float(time[n]), float(time[n + 1]), 0.0, float(change[n - 3]) / usual_step)]
    return sorted(jumps, key=lambda each: -abs(each.size))


_FEWEST = 40
"""Samples of a recording that show what is usual in it."""
_KINK = 3.0
"""Times what 98 of 100 places of a recording have, that a velocity changes over four samples where it jumps."""


# ---- of the motion ----


def _carried(at: Along, forces: Array, kicks: tuple[int, Array] | None = None) -> Array:
    """Changes of the place by accelerations (times, columns) along a motion; kicks: a time's number, and what place and
    velocity change by there, (2, columns).
    """
    steps = np.diff(at.t)
    count, columns = forces.shape
    place, speed = np.zeros(columns), np.zeros(columns)
    changes = np.zeros((count, columns))
    still = (at.v[:-1] == 0.0) & (at.v[1:] == 0.0)
    turns = _turns(at)
    tables = {h: _propagator(at.sprung, at.damping, h) for h in np.unique(steps).tolist()}
    means = 0.5 * (forces[1:] + forces[:-1])
    for n, h in enumerate(steps.tolist()):
        if kicks is not None and kicks[0] == n:
            place, speed = place + kicks[1][0], speed + kicks[1][1]
        if still[n]:
            speed = np.zeros(columns)
        else:
            (a, b), (c, d), (e, f) = tables[h]
            place, speed = a * place + b * speed + e * means[n], c * place + d * speed + f * means[n]
            if turns[n] != 1.0:
                speed = speed * turns[n]
        changes[n + 1] = place
    return changes


def _turns(at: Along) -> Array:
    """What a change of velocity is scaled by over each step: the ratio of the accelerations where the mass turns back."""
    v, factors = at.v, np.ones(at.t.size - 1)
    for n in np.flatnonzero(v[:-1] * v[1:] < 0.0).tolist():
        if 1 <= n < v.size - 2:
            before = (v[n] - v[n - 1]) / max(at.t[n] - at.t[n - 1], 1e-12)
            after = (v[n + 2] - v[n + 1]) / max(at.t[n + 2] - at.t[n + 1], 1e-12)
            factors[n] = min(max(after / before, 0.0), 1.0) if before != 0.0 else 1.0
    return factors


def _propagator(stiffness: float, damping: float, h: float) -> tuple[tuple[float, float], ...]:
    """Rows of place and velocity after a step [s] of x'' = -s x - d x', and what a constant acceleration adds."""
    matrix = np.array([[0.0, 1.0, 0.0], [-stiffness, -damping, 1.0], [0.0, 0.0, 0.0]]) * h
    (a, b, e), (c, d, f), _ = of_scipy("linalg").expm(matrix).tolist()
    return (a, b), (c, d), (e, f)


def _kicked(carried: Sequence[tuple[Experiment, Along]], number: int, jump: Jump) -> Array:
    """Another place and velocity of one recording from a jump on."""
    experiment, at = carried[number]
    kicks = int(np.searchsorted(at.t, jump.before)), np.eye(2) * np.array([1.0, at.fastest])
    columns = seen_at(experiment, at, _carried(at, np.zeros((at.t.size, 2)), kicks))
    # the jump is between two samples
    columns[: jump.sample + 1] = 0.0
    return _blocks([each for each, _ in carried], number, columns)


_PITCHES = np.arange(1.5, 20.0, 0.3)
"""Pitches of a ripple over the way of the motion: of fewer it is no ripple but a spring."""


def _ripples(carried: Sequence[tuple[Experiment, Along]]) -> list[Rival]:
    """Ripples of all pitches: of each the sine and the cosine of the place."""
    way = max(float(np.ptp(at.x)) for _, at in carried)
    parts = list[Array]()
    for experiment, at in carried:
        phase = 2.0 * math.pi * np.outer(at.x, _PITCHES) / max(way, 1e-300)
        forces = at.force * np.hstack([np.sin(phase), np.cos(phase)])
        parts.append(seen_at(experiment, at, _carried(at, forces)))
    whole, count = np.concatenate(parts), _PITCHES.size
    return [Rival("ripple", way / float(each), whole[:, [n, count + n]]) for n, each in enumerate(_PITCHES)]


_LEAST_LINK, _LINKS, _DAMPED = 3.0, 40, (0.02, 0.1)
"""[Hz] of the slowest link that is tried, how many frequencies up to a third of the rate, and their damping ratios."""


def _links(carried: Sequence[tuple[Experiment, Along]]) -> list[Rival]:
    """Links of all frequencies and two damping ratios: their sensor on either side."""
    step = min(float(np.median(np.diff(each.time))) for each, _ in carried)
    most = min(0.3 / step, 120.0)
    shapes = [(f, z) for f in np.geomspace(_LEAST_LINK, max(most, 2.0 * _LEAST_LINK), _LINKS).tolist() for z in _DAMPED]
    seen, felt = list[Array](), list[Array]()
    for experiment, at in carried:
        bends, reacts = _oscillators(at, shapes)
        seen.append(seen_at(experiment, at, bends))
        felt.append(seen_at(experiment, at, _carried(at, reacts)))
    left, right = np.concatenate(seen), np.concatenate(felt)
    return [Rival("link", f, np.stack([left[:, n], right[:, n]], axis=1)) for n, (f, _) in enumerate(shapes)]


def _oscillators(at: Along, shapes: Sequence[tuple[float, float]]) -> tuple[Array, Array]:
    """How far oscillators of frequencies [Hz] and damping ratios are off a base that moves, and what their acceleration
    takes off that of the base.

    Of e'' + d e' + w^2 e = -a, z = e' + d/2 e + i o e with o^2 = w^2 - d^2/4 has z' = (i o - d/2) z - a: a step is
    z exp((i o - d/2) h) under the mean of a, and all steps are one system of two diagonals.
    """
    rate, steps = np.gradient(at.v, at.t), np.diff(at.t)
    means = 0.5 * (rate[1:] + rate[:-1])
    bends, reacts = np.zeros((2, at.t.size, len(shapes)))
    for n, (frequency, ratio) in enumerate(shapes):
        omega = 2.0 * math.pi * frequency
        turning = omega * complex(-ratio, math.sqrt(1.0 - ratio**2))
        turned = np.exp(turning * steps)
        band = np.stack([np.ones(at.t.size, complex), np.append(-turned, 0.0)])
        pushed = np.append(0.0, means * (1.0 - turned) / turning)
        z = of_scipy("linalg").solve_banded((1, 0), band, pushed, check_finite=False)
        bends[:, n] = z.imag / turning.imag
        reacts[:, n] = omega**2 * bends[:, n] + 2.0 * ratio * omega * (z.real - ratio * omega * bends[:, n])
    return bends, reacts


def bending(at: Along, frequency: float) -> tuple[Array, Array]:
    """How far a link of a frequency [Hz] is off a motion, and what its acceleration takes off that of the motion."""
    bends, reacts = _oscillators(at, [(frequency, _DAMPED[-1])])
    return bends[:, 0], reacts[:, 0]
