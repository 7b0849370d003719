"""Drop tests: x2 over time with the actuator held, by (4), or free, by (3) and (4).

    m_s x2'' = k (L0 + c - x2) - b2 x2' - m_s g - m_s f2 sign(x2')

The fit starts from the data: the lowest point of a fall and the rest after it give k/m_s.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, Unpack

import numpy as np

from hopform import HopformError
from hopform._checks import flag
from hopform.identify._estimation import Parameter
from hopform.identify._fits import Fit, Options, fit
from hopform.identify._kinds import Cut, Group, Guess, Kind, Recordings, scale_of_body
from hopform.identify._motion import Array, Known, Values, held_at
from hopform.identify._recordings import (
    Recording,
    calm,
    gaps_of,
    known_spans,
    mended,
    noise_of,
    quantum_of,
    steps_of,
)
from hopform.identify._rigs import LETTERS
from hopform.identify._rigs import Kind as Rig
from hopform.identify._segments import CUTOFFS, drops, filtered_part, moving_rows


class Oscillation(NamedTuple):
    """Estimates from a drop: its rest [m], angular frequency [rad/s], b2/m_s [1/s] and f2 [m/s^2]."""

    rest: float
    omega: float
    viscous: float
    coulomb: float


def fit_drop_test(
    recordings: Recordings,
    *,
    free: bool = False,
    known: Known = None,
    **options: Unpack[Options],
) -> Fit:
    """Spring, mass and friction of a body from recordings of x2, by least squares on exact motions.

    The body is dropped, meets the ground and may hop, once or several times in a recording; the actuator is held. free:
    it is not, and moves under the recorded current (0 if there is none) from x1 = 0, or from where it is if x1 is
    recorded too; then m_eff, b1, f1, gamma2 are fitted as well. A body that is fixed to its spring is a slide: `fit`.

    known: values of m_s, k, b2, f2, length (L0 + c), impact_loss, g, which is 9.81 m/s^2 if not given; with `free` of m_eff, b1, f1, gamma2, offset, and the stops x1_min, x1_max, which are none if not given. If no
    mass is known and none was added, m_s is taken as 1 kg: k is k/m_s, b2 is b2/m_s. With different added masses
    friction is fitted per recording (b2@0, f2@0, ...). options: `Options`. Raises HopformError for data that cannot be
    a drop test, MissingExtra without scipy.
    """
    return fit({FREE if flag("free", free) else GROUND: recordings}, known, **options)


class _Body(Kind):
    """A body on its spring, dropped over a held or a free actuator."""

    def check(self, group: Group, scaled: bool) -> Group:
        """With what fixes the scale; HopformError for a drop of an angle, or without gravity."""
        known, recordings = group.known, group.recordings
        if group.units.position != "m":
            raise recordings[0].error(
                "is an angle; a drop is of a height in m", recordings[0].head, recordings[0].column_of("x2")
            )
        if not known["g"] > 0.0:
            raise HopformError(f"known: g must be > 0 m/s^2 for a drop, got {known['g']!r}")
        if self.driven and known["x1_min"] > known["x1_max"]:
            raise HopformError(f"known: x1_min must be <= x1_max, got {known['x1_min']!r} and {known['x1_max']!r} m")
        return scale_of_body(group)

    def segment(self, group: Group, first: int) -> Group:
        """With the motions from their releases on, and without what no current of them shows."""
        cuts = [cut for n, each in enumerate(group.recordings, first) for cut in _cuts(each, n, self, group.known["g"])]
        held, statements = _driven(cuts) if self.driven else ({}, [])
        return replace(group, cuts=cuts, known={**held, **group.known}, statements=(*group.statements, *statements))

    def start(self, group: Group) -> list[list[Guess]]:
        """From frequencies, envelopes and added masses; an actuator whose x1 is recorded also from its own motion."""
        cuts, known, tries = [cut.mended() for cut in group.cuts], group.known, list[list[Guess]]()
        for rounds in (1, _REFINED) if any(cut.x1 is not None for cut in cuts) else (1,):
            oscillations = [_guess(cut, self.rig, known["g"], rounds) for cut in cuts]
            shared = _shared_starts(known, oscillations, group.masses, self.rig)
            starts = zip(shared, cuts, strict=True)
            first = [_with_own(*each) for each in starts]
            seen = [(cut, cut.x1, one) for cut, one in zip(cuts, oscillations, strict=True) if cut.x1 is not None]
            cutoffs = sorted(CUTOFFS, reverse=True)  # hits of a stop are short
            driven = [_driven_start(*each, known, cutoff) for each in seen for cutoff in cutoffs]
            tries += [first, *([each | other for each in first] for other in driven)]
        return tries

    def bounded(self, parameter: Parameter, letter: str, cut: Cut, known: Values) -> Parameter:
        """An actuator begins within its stops; at a stop it moves away from it, if at all: into it a velocity is lost
        at once.
        """
        if letter not in ("x1", "v1"):
            return parameter
        low, high, x1 = known["x1_min"], known["x1_max"], cut.x if cut.x1 is None else cut.x1
        place, near = float(np.median(x1[:5])), 8.0 * max(noise_of(x1), quantum_of(x1))
        if letter == "v1":
            low, high = (0.0 if place < low + near else -math.inf), (0.0 if place > high - near else math.inf)
        return parameter._replace(start=min(max(parameter.start, low), high), low=low, high=high)

    def further(self, starts: Sequence[Guess]) -> list[Guess]:
        """What the data show, then all friction viscous, then most of it Coulomb's; a drop also with other springs.

        A free actuator of which nothing is seen starts from lighter and heavier, less and more damped, pushed either
        way: of it x2 shows little by itself.
        """
        seen = starts[1:]
        tries = [each for start in seen or starts for each in _traded(start)]
        return _pushed(tries) if self.driven and not seen else tries


def _driven(cuts: Sequence[Cut]) -> tuple[Guess, list[str]]:
    """gamma2 and a constant load where the currents of a free actuator do not identify them: they are held then."""
    levels = np.array([u for cut in cuts for _, u in cut.steps])
    if not levels.any():
        why = "no current flows: gamma2 cannot be identified; record a drop under a constant current too"
        return {"gamma2": 1.0, "offset": 0.0}, [why]
    if float(np.ptp(levels)) <= 0.02 * float(np.abs(levels).max()):
        return {"offset": 0.0}, ["the current is constant: a constant load of the actuator counts as part of gamma2 u"]
    return {}, []


def _cuts(recording: Recording, number: int, kind: Kind, g: float) -> list[Cut]:
    """The motions of a recording from their releases on, found to a sample where the actuator is free: until then it
    rests.
    """
    rig = kind.rig
    values = recording.position("x2")
    clean = mended(values)
    spans = drops(recording, clean, rig == "free")
    driven = kind.driven and recording.has_current()
    x1 = recording.columns["x1"].values if rig == "free" and "x1" in recording.columns else None
    cuts = list[Cut]()
    step = float(np.median(np.diff(recording.time)))
    if driven and len(known_spans(recording)) > 1:
        begin, length = max(gaps_of(recording.time), key=lambda gap: gap[1])
        message = f"changes over a gap of {length:.3g} s after {begin:.4g} s: a drop needs its whole current"
        raise recording.error_of("u", message, int(np.searchsorted(recording.time, begin)))
    for n, (seen, end) in enumerate(spans, 1):
        fallen = max(float(np.median(clean[max(seen - 20, 0) : max(seen - 5, 1)])) - float(clean[seen]), 0.0)
        if rig == "ground":
            _check_fall(recording, seen, clean[seen:end], g)
        start = max(seen - round(math.sqrt(2.0 * fallen / g) / step), 0) if rig == "free" else seen
        which = f", drop {n}" if len(spans) > 1 else ""
        time, label = recording.time[start:end], f"{recording.source}{which}"
        begin = float(time[0])
        steps = steps_of(recording, start, end) if driven else ((0.0, 0.0),)
        beside = None if x1 is None else x1[start:end]
        still = {"x1": 0.0, "v1": 0.0} if rig == "free" and x1 is None else {}
        cuts.append(Cut(recording, number, label, time - begin, values[start:end], begin, steps, beside, still))
    return cuts


def _lowest(x: Array) -> int:
    """The lowest sample of a first fall."""
    rises = np.flatnonzero(x > np.minimum.accumulate(x) + 0.05 * float(np.ptp(x)))
    return int(x[: int(rises[0]) if rises.size else None].argmin())


def _check_fall(recording: Recording, line: int, x: Array, g: float) -> None:
    """HopformError if a free fall does not show g: then the units of height or time cannot be right."""
    lowest = _lowest(x)
    fallen = np.flatnonzero(x[:lowest] < x[0] - 0.4 * (x[0] - x[lowest]))
    count = int(fallen[0]) if fallen.size else lowest
    if count < 5:
        return
    powers = np.vander(recording.time[line : line + count] - recording.time[line], 3)
    acceleration = -2.0 * float(np.linalg.lstsq(powers, x[:count], rcond=None)[0][0])
    margin = 6.0 * noise_of(x) * math.sqrt(float(np.linalg.pinv(powers.T @ powers)[0, 0]))
    if not g / 3.0 - margin < acceleration < 3.0 * g + margin:
        fall = f"falls with {acceleration:.3g} m/s^2, not {g / 3.0:.3g} to {3.0 * g:.3g} as g = {g:.4g}"
        message = f"{fall}: is its unit right, is that of time, is this the release?"
        raise recording.error_of("x2", message, line)


def _guess(cut: Cut, rig: Rig, g: float, rounds: int) -> Oscillation:
    """Estimates from one motion: by its lowest point and its rest, or by its stances where the actuator is free."""
    if rig == "free":
        return _stances(cut, np.zeros_like(cut.x) if cut.x1 is None else cut.x1, g, rounds)
    x = cut.x
    rest, low = float(np.median(x[-max(x.size // 10, 5) :])), float(x.min())
    # m_s g (top - low), less a tenth, goes into the spring: k (L0 - low)^2/2, L0 = rest + m_s g/k.
    depth = max(rest - low, 1e-6)
    half = 0.9 * (float(x.max()) - low) - depth
    sag = half - math.sqrt(half * half - depth * depth) if half > depth else max(depth, 1e-4)
    return Oscillation(rest, math.sqrt(g / max(sag, 1e-5)), 0.1 * math.sqrt(g / max(sag, 1e-5)), 0.3)


_REFINED = 3
"""Rounds in which the length is refined, for a second start: the body is seen to leave its parabola long after it does.
"""


def _stances(cut: Cut, x1: Array, g: float, rounds: int) -> Oscillation:
    """The same of a leg without a rest of its own: L0 is where the body leaves its parabola, the rest by least squares
    on (4) with all stances; if that leads nowhere by m_s g (top - low) = k (L0 - low)^2/2, less a tenth.
    """
    time, x = cut.time, cut.x
    lowest = _lowest(x)
    depth = max(float(x[0] - x[lowest]), 1e-3)
    early = max(int(np.count_nonzero(x[:lowest] > x[0] - 0.3 * depth)), 5)
    v, start = np.polyfit(time[:early], x[:early] + 0.5 * g * time[:early] ** 2, 1)
    noise = max(noise_of(x), quantum_of(x), 1e-9)
    off = np.abs(calm(x) - start - v * time + 0.5 * g * time**2)[early:] > 8.0 * noise + 0.01 * depth
    length = float((x - x1)[early + int(off.argmax())])
    step = float(np.median(np.diff(time)))
    omega = math.sqrt(1.8 * g * depth) / max(length - float((x - x1)[lowest]), 1e-3)
    oscillation = Oscillation(length - g / omega**2, omega, 0.1 * omega, 0.3)
    for n in range(rounds):  # m_s a = k (length - x + x1) - ...: what is missing of the length is a constant
        rows = filtered_part(time, x, np.maximum(length - x + x1, 0.0), step, min(CUTOFFS[-1], 0.2 / step))
        stance = rows.u > (0.3 if n else 0.1) * float(rows.u.max())
        sides = np.stack([rows.u, -rows.v, -rows.side, rows.one if n else 0.0 * rows.one], axis=1)[stance]
        seen = np.linalg.lstsq(sides, rows.acceleration[stance] + g * rows.one[stance], rcond=None)[0]
        square, viscous, coulomb, missing = seen.tolist()
        if not square > 0.0:
            break
        length += min(max(missing / square, -depth), depth)
        oscillation = Oscillation(length - g / square, math.sqrt(square), max(viscous, 0.0), max(coulomb, 0.0))
    return oscillation


def _shared_starts(known: Values, guesses: Sequence[Oscillation], added: Sequence[float], rig: Rig) -> list[Guess]:
    """Where the letters of each motion start, from frequencies, envelopes and added masses."""
    square = np.array([guess.omega**2 for guess in guesses])
    extra = np.array(added)
    if "m_s" in known:
        mass = known["m_s"]
    elif "k" in known:
        mass = max(float(np.mean(known["k"] / square - extra)), 1e-3 * float(np.mean(known["k"] / square)))
    elif float(np.ptp(extra)) > 0.0:  # 1/omega^2 = (m_s + added)/k: a line over the added mass
        slope, height = np.polyfit(extra, 1.0 / square, 1)
        mass = max(float(height / slope), 1e-2 * float(extra.max())) if slope > 0.0 else float(extra.max())
    else:
        mass = 0.2 * known.get("m_eff", 5.0)
    k = known.get("k", float(np.mean(square * (mass + extra))))
    sags = [(mass + m) * known["g"] / k for m in added]
    length = float(np.mean([guess.rest + sag for guess, sag in zip(guesses, sags, strict=True)]))
    start = {"m_s": mass, "k": k, "length": length, "impact_loss": 0.05}
    if rig == "free":
        m_eff = known.get("m_eff", 5.0 * mass)
        start |= {"m_eff": m_eff, "b1": 5.0 * m_eff, "f1": 0.5, "gamma2": -10.0 * mass, "offset": 0.0}
    return [start | {"b2": one.viscous * (mass + m), "f2": one.coulomb} for one, m in zip(guesses, added, strict=True)]


def _driven_start(cut: Cut, x1: Array, guess: Oscillation, known: Values, cutoff: float) -> dict[str, float]:
    """Least squares on (3) for an actuator whose x1 was recorded, through a filter: acceleration over v1, current and
    compression.
    """
    step = float(np.median(np.diff(cut.time)))
    cutoff = min(cutoff, 0.2 / step)
    u = held_at(cut.steps, cut.time)
    length = known.get("length", guess.rest + known["g"] / guess.omega**2)
    rows, pressed = (filtered_part(cut.time, x1, by, step, cutoff) for by in (u, np.maximum(x1 - cut.x + length, 0.0)))
    b, f, gamma, constant, k = moving_rows(rows, [-rows.v, -rows.side, -rows.u, rows.one, -pressed.u], robust=True)
    stiffness = known.get("k", guess.omega**2 * (known.get("m_s", 1.0) + cut.recording.added_mass))
    by_force = known["gamma2"] / gamma if "gamma2" in known and gamma else None
    masses = (known.get("m_eff"), by_force, stiffness / k if k else None)
    mass = next((each for each in masses if each is not None and each > 0.0), 5.0 * known.get("m_s", 1.0))
    start = {"m_eff": mass, "b1": max(b, 0.01) * mass, "f1": max(f, 0.0), "gamma2": gamma * mass}
    return start | {"offset": -constant / gamma if gamma else 0.0}


def _with_own(shared: Guess, cut: Cut) -> Guess:
    """Where a motion begins too: place and velocity of the body, and of the actuator."""
    lines = [np.polyfit(cut.time[:5], each[:5], 1) for each in (cut.x, cut.x1) if each is not None]
    return shared | dict(zip(("v", "x", "v1", "x1"), np.ravel(lines).tolist(), strict=False))


def _traded(first: Guess) -> list[Guess]:
    """A start with its friction as it is, with more of it Coulomb's, and with other springs."""
    coulomb, viscous = ([name for name in first if name.startswith(letter)] for letter in ("f2", "b2"))
    tries = [first]
    if coulomb and viscous:
        less = {name: 0.5 * first[name] for name in viscous}
        tries.append(first | less | {name: 1.5 * first[name] + 0.05 for name in coulomb})
    if "k" in first:
        tries += [first | {"k": factor * first["k"]} for factor in (0.6, 1.6)]
    return tries


def _pushed(tries: list[Guess]) -> list[Guess]:
    """Starts of an actuator of which nothing is seen."""
    first = tries[0]
    for name, factors in (("m_eff", (0.4, 1.0, 2.5)), ("b1", (0.25, 1.0)), ("gamma2", (1.0, -1.0, 4.0, -4.0))):
        if name in first:
            tries = [start | {name: factor * start[name]} for start in tries for factor in factors]
        if name == "m_eff" and "b1" in first and "m_eff" in first:  # b1/m_eff is kept
            tries = [start | {"b1": start["b1"] * start["m_eff"] / first["m_eff"]} for start in tries]
    return tries


GROUND = _Body("ground", "x2", LETTERS["ground"], {"g": 9.81}, (0.35, 0.65, 1.0))
FREE = _Body("free", "x2", LETTERS["free"], {"g": 9.81, "x1_min": -math.inf, "x1_max": math.inf},
             (0.25, 0.45, 0.7, 1.0))  # fmt: skip
"""Of a leg a fit is followed over more and more: each hop multiplies what is wrong about the one before."""
