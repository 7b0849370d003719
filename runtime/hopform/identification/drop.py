"""Drop tests and free decays: x2 over time with the actuator held, by (4).

    m_s x2'' = k (L0 + c - x2) - b2 x2' - m_s g - m_s f2 sign(x2')

The fit starts from the data: the frequency of the swings gives k/m_s, their envelope the friction. Successive extrema about the
rest obey |A_(n+1)| = a |A_n| - d with a = exp(-b2 T/(4 m_s)) and d = (1 + a) f2 m_s/k: an envelope that falls along a line is
Coulomb's, one that falls exponentially is viscous.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hopform.errors import HopformError
from hopform.identification import recordings as of_recordings
from hopform.identification.estimation import Parameter, Progress
from hopform.identification.fits import Fit, Problem, checked_known, finish
from hopform.identification.motion import Array
from hopform.identification.recordings import Recording
from hopform.identification.rigs import UNITS, Experiment, Kind

_SHARED = ("m_s", "k", "b2", "f2", "length", "impact_loss")


class Swing(NamedTuple):
    """What a decay shows by itself: its rest [m], angular frequency [rad/s], b2/m_s [1/s] and f2 [m/s^2]."""

    rest: float
    omega: float
    viscous: float
    coulomb: float


def swing_of(time: Array, values: Array) -> Swing:
    """Frequency and friction of an oscillation about a rest, from its extrema; a guess where there are too few."""
    noise = max(of_recordings.noise_of(values), of_recordings.quantum_of(values))
    values = of_recordings.calm(values)
    rest = float(np.median(values[-max(values.size // 10, 5) :]))
    omega = _spectral_peak(time, values - rest)
    extrema = _extrema(time, values - rest, math.pi / omega, 4.0 * noise)
    if len(extrema) < 3:
        return Swing(rest, omega, 0.2 * omega, 0.0)
    at, size = np.array([t for t, _ in extrema]), np.abs([a for _, a in extrema])
    omega = math.pi / float(np.median(np.diff(at)))
    if len(extrema) < 4:
        return Swing(rest, omega, max(2.0 * omega / math.pi * math.log(size[0] / size[1]), 0.0), 0.0)
    slope, drop = np.polyfit(size[:-1], size[1:], 1, w=np.sqrt(size[:-1]))
    ratio = min(max(float(slope), 0.05), 1.0)
    viscous = -2.0 * omega / math.pi * math.log(ratio)
    return Swing(rest, omega, viscous, max(-float(drop), 0.0) * omega**2 / (1.0 + ratio))


def _spectral_peak(time: Array, values: Array) -> float:
    """Angular frequency of the largest peak of the spectrum, on even times, padded with zeros."""
    step = float(np.median(np.diff(time)))
    even = np.interp(np.arange(time[0], time[-1], step), time, values)
    even = even - even.mean()
    length = 8 * even.size
    power = np.abs(np.fft.rfft(even * np.hanning(2 * even.size)[even.size :], length))
    return float(2.0 * math.pi * max(int(power[1:].argmax()) + 1, 1) / (length * step))


def _extrema(time: Array, values: Array, half: float, least: float) -> list[tuple[float, float]]:
    """Times and sizes of the swings: the largest deviation between crossings of the rest, as long as they exceed the noise."""
    signs = np.signbit(values)
    edges = [0, *(np.flatnonzero(signs[1:] != signs[:-1]) + 1).tolist(), values.size]
    found = list[tuple[float, float]]()
    for begin, end in zip(edges[:-1], edges[1:], strict=True):
        if time[min(end, values.size - 1)] - time[begin] < 0.4 * half and begin > 0:
            continue
        peak = begin + int(np.abs(values[begin:end]).argmax())
        if abs(values[peak]) < least:
            break
        found.append((float(time[peak]), float(values[peak])))
    return found


def fit_drop_test(
    recordings: Sequence[Recording] | Recording,
    *,
    attached: bool = False,
    known: Mapping[str, float] | None = None,
    loss: str = "linear",
    compare: bool = True,
    holdout: bool = True,
    backend: str | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Spring, mass and friction of a body from recordings of x2 with the actuator held, by least squares on exact motions.

    attached: the body is fixed to its spring (a cart, a clamped foot), which pushes and pulls; else it is dropped, meets the
    ground, and may hop. known: values of m_s, k, b2, f2, length (L0 + c), impact_loss, g; g is 9.81 m/s^2 for a drop, 0 for an
    attached body. If no mass is known and none was added, m_s is taken as 1 kg: k is k/m_s, b2 is b2/m_s. With different added
    masses friction is fitted per recording (b2@0, f2@0, ...). loss: linear, or soft_l1, huber, cauchy against outliers. compare:
    fit the old model (2) too. Raises HopformError for data that cannot be a drop test, MissingExtra without scipy.
    """
    several = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    problem = drop_problem(several, attached, known, backend)
    parts = (0.3, 1.0) if attached else (0.35, 0.65, 1.0)
    return finish(problem, loss=loss, parts=parts, compare=compare, holdout=holdout, progress=progress)


def drop_problem(
    recordings: Sequence[Recording],
    attached: bool = False,
    known: Mapping[str, float] | None = None,
    backend: str | None = None,
    first: int = 0,
) -> Problem:
    """The least-squares problem of drop tests; first: the number of the first recording in names of parameters (x@0)."""
    if not recordings:
        raise HopformError("a fit needs at least one recording, got none")
    letters = ("m_s", "k", "b2", "f2") + (() if attached else ("length", "impact_loss"))
    values = checked_known(known, (*letters, "g"))
    values.setdefault("g", 0.0 if attached else 9.81)
    if not attached and not values["g"] > 0.0:
        raise HopformError(f"known: g must be > 0 m/s^2 for a drop, got {values['g']!r}")
    added = {each.added_mass for each in recordings}
    apart = len(added) > 1
    statements = list[str]()
    if "m_s" not in values and not apart:
        if "k" in values:
            statements.append("m_s follows from the known k")
        else:
            values["m_s"] = 1.0
            statements.append(
                "motion alone fixes k/m_s and b2/m_s: k and b2 are per kg of m_s; weigh the body (known m_s), or record "
                "again with a weighed mass added"
            )
    cut = [_cut(each, attached) for each in recordings]
    guesses = [_guess(time, x, attached, values["g"]) for time, x, _ in cut]
    shared = _shared_starts(values, guesses, [each.added_mass for each in recordings], attached)
    kind: Kind = "attached" if attached else "ground"
    experiments, parameters = list[Experiment](), dict[str, Parameter]()
    for n, (recording, (time, x, begin)) in enumerate(zip(recordings, cut, strict=True), first):
        own = ("rest", "x", "v") if attached else ("x", "v")
        names = {letter: f"{letter}@{n}" if apart and letter in ("b2", "f2") else letter for letter in letters}
        names = {letter: name for letter, name in names.items() if letter not in values}
        names |= {letter: f"{letter}@{n}" for letter in own}
        for letter, name in names.items():
            start = shared[letter][n - first] if letter in shared else _own_start(letter, time, x, guesses[n - first])
            parameters.setdefault(name, _parameter(letter, name, start, x))
        experiments.append(
            Experiment(
                recording.source,
                kind,
                time,
                x,
                names,
                values,
                added_mass=recording.added_mass,
                begin=begin,
                backend=backend,
            )
        )
    coulomb = tuple(name for name in parameters if name.startswith("f2"))
    notes = tuple(f"{each.source}: {note}" for each in recordings for note in each.notes)
    return Problem(
        "drop", "x2", tuple(experiments), tuple(parameters.values()), _starts(parameters, attached), values, tuple(statements),
        notes, coulomb,
    )  # fmt: skip


def _cut(recording: Recording, attached: bool) -> tuple[Array, Array, float]:
    """Times from the release on, positions, and when that was."""
    values = recording.position("x2")
    start, end = of_recordings.free_decay(recording, values) if attached else of_recordings.drop(recording, values)
    time = recording.time[start:end]
    return time - time[0], values[start:end], float(time[0])


def _guess(time: Array, x: Array, attached: bool, g: float) -> Swing:
    """What one recording shows: a decay by its swings, a drop by its lowest point and its rest."""
    if attached:
        return swing_of(time, x)
    rest, low, top = float(np.median(x[-max(x.size // 10, 5) :])), float(x.min()), float(x.max())
    # m_s g (top - low), less a tenth, goes into the spring: k (L0 - low)^2/2, L0 = rest + m_s g/k.
    depth, fall = max(rest - low, 1e-6), 0.9 * (top - low)
    half = fall - depth
    sag = half - math.sqrt(half * half - depth * depth) if half > depth else max(depth, 1e-4)
    return Swing(rest, math.sqrt(g / max(sag, 1e-5)), 0.1 * math.sqrt(g / max(sag, 1e-5)), 0.3)


def _shared_starts(
    known: Mapping[str, float], guesses: Sequence[Swing], added: Sequence[float], attached: bool
) -> dict[str, list[float]]:
    """Where each letter starts, per recording, from frequencies, envelopes and added masses."""
    square = np.array([guess.omega**2 for guess in guesses])
    extra = np.array(added)
    if "m_s" in known:
        mass = known["m_s"]
    elif "k" in known:
        mass = max(float(np.mean(known["k"] / square - extra)), 1e-3)
    else:  # 1/omega^2 = (m_s + added)/k: a line over the added mass
        slope, height = np.polyfit(extra, 1.0 / square, 1)
        mass = max(float(height / slope), 1e-2 * float(extra.max())) if slope > 0.0 else float(extra.max())
    k = known.get("k", float(np.mean(square * (mass + extra))))
    starts = {
        "m_s": [mass] * len(guesses),
        "k": [k] * len(guesses),
        "b2": [guess.viscous * (mass + m) for guess, m in zip(guesses, added, strict=True)],
        "f2": [guess.coulomb for guess in guesses],
    }
    if not attached:
        length = float(
            np.mean([guess.rest + (mass + m) * known["g"] / k for guess, m in zip(guesses, added, strict=True)])
        )
        starts |= {"length": [length] * len(guesses), "impact_loss": [0.05] * len(guesses)}
    return starts


def _own_start(letter: str, time: Array, x: Array, guess: Swing) -> float:
    if letter == "rest":
        return guess.rest
    count = min(5, x.size)
    slope, height = np.polyfit(time[:count], x[:count], 1)
    return float(slope) if letter == "v" else float(height)


def _parameter(letter: str, name: str, start: float, x: Array) -> Parameter:
    reach = float(np.ptp(x))
    kinds = {"m_s": "positive", "k": "positive", "b2": "nonnegative", "f2": "nonnegative", "impact_loss": "fraction"}
    kind = kinds.get(letter, "real")
    scales = {"rest": 0.1 * reach, "x": 0.1 * reach, "length": 0.1 * reach, "v": reach, "impact_loss": 0.1}
    scale = scales.get(letter, max(abs(start), 0.1))
    return Parameter(name, UNITS[letter], start, scale, kind, profiled=letter == "f2", own=letter in ("rest", "x", "v"))


def _starts(parameters: Mapping[str, Parameter], attached: bool) -> tuple[dict[str, float], ...]:
    """Starts: what the data show, then all friction viscous, then most of it Coulomb's; a drop also with other springs."""
    first = {name: each.start for name, each in parameters.items()}
    coulomb = [name for name in first if name.startswith("f2")]
    viscous = [name for name in first if name.startswith("b2")]
    if not coulomb or not viscous:
        return (first,)
    less = {name: 0.5 * first[name] for name in viscous}
    more = {name: 1.5 * first[name] + 0.05 for name in coulomb}
    tries = [first, first | less | more]
    if not attached and "k" in first:
        tries += [first | {"k": factor * first["k"]} for factor in (0.6, 1.6)]
    return tuple(tries)
