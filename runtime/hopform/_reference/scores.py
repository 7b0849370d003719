"""The score of a simulator: its states, rest, events and derivatives beside the exact ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from hopform._checks import function as checked_function
from hopform._checks import number_of, shown
from hopform._errors import HopformError
from hopform._reference.cases import Answer, Case, Floats, Gradient, case_named, cases

Simulator = Callable[[Case], Any]
"""What is scored: from a case its states, or a mapping with `states` and, if it has them, `events`, `values`,
`gradients`; None for a case that it cannot say."""
PARTS = ("states", "events", "values", "gradients")
NONE = math.nan


@dataclass(frozen=True)
class Simulated:
    """What a simulator returned, checked. gradients: NaN where it has none."""

    states: dict[str, Floats]
    events: tuple[tuple[float, str], ...] | None
    values: dict[str, float]
    gradients: tuple[float, ...] | None


@dataclass(frozen=True)
class GradientScore:
    """A derivative: exact, by the simulator's differences, and its own; NaN where there is none."""

    of: str
    by: str
    exact: float
    differences: float
    own: float


@dataclass(frozen=True)
class Score:
    """How far a simulator is from the answer to a case; NaN, and None of a count, where it returned nothing to compare.

    unit: of positions. rms, rms_velocity: root mean square of the errors of all positions, of all velocities, at all
    times. creep: the largest mean velocity between two instants between which a coordinate stands still. event_error
    [s]: the largest error of an event's time; missed, extra: events that are not there, and that should not be. values:
    errors by name. gradients: derivatives beside the exact ones.
    """

    case: str
    unit: str
    rms: float
    rms_velocity: float
    creep: float
    event_error: float
    missed: int | None
    extra: int | None
    values: Mapping[str, float]
    gradients: tuple[GradientScore, ...]


def score(function: Simulator, names: str | Iterable[str] | None = None) -> tuple[Score, ...]:
    """How far a simulator is from the exact answers of the reference set, a score for each case.

    function: takes a `Case`, and returns states at `case.times`, as an array of (times, outputs) or as a mapping by the
    names of `case.outputs`; or a mapping with such `states` and, if it has them, `events` as (time, kind), `values` by
    name and `gradients`, a number for each of `case.answer.gradients`; or None for a case that it cannot say. It is
    called again with changed numbers for the central differences. names: of the cases; all if left out.

    Raises HopformError for a name of no case, and for what the function returns or raises.

    >>> def creeps(case):
    ...     return {"q": 1e-3 * case.times, "v": 1e-3 + 0.0 * case.times}
    >>> (found,) = score(creeps, "hold")
    >>> print(f"{found.creep:.1e} {found.unit}/s at rest, {found.rms:.1e} {found.unit}")
    1.0e-03 rad/s at rest, 1.2e-03 rad
    """
    simulate = checked_function("function", function)
    return tuple(score_of(simulate, case) for case in cases(names))


def score_of(simulate: Simulator, case: Case) -> Score:
    """The score of one case."""
    found, exact = simulated(simulate, case), case.exact
    if found is None:
        gradients = tuple(GradientScore(each.of, each.by, each.value, NONE, NONE) for each in exact.gradients)
        return Score(case.name, case.units[case.positions[0]], NONE, NONE, NONE, NONE, None, None, {}, gradients)
    error, missed, extra = events_apart(found, exact)
    return Score(
        case.name, case.units[case.positions[0]],
        rms(case.positions, found, exact), rms(case.velocities, found, exact), creep(case, found),
        error, missed, extra,
        {name: found.values[name] - value for name, value in exact.values.items() if name in found.values},
        gradient_scores(simulate, case, found),
    )  # fmt: skip


def rms(names: Sequence[str], found: Simulated, exact: Answer) -> float:
    """The root mean square of the errors of some states."""
    errors = np.array([found.states[name] - exact.states[name] for name in names])
    return float(np.sqrt(np.mean(errors**2)))


def creep(case: Case, found: Simulated) -> float:
    """The largest mean velocity of what stands still; NaN where nothing does."""
    rates = [NONE]
    for each in case.exact.held:
        begin, end = np.searchsorted(case.times, [each.begin, each.end])
        column = found.states[each.of]
        rates.append(abs(float(column[end] - column[begin])) / (each.end - each.begin))
    return float(np.fmax.reduce(rates))


def events_apart(found: Simulated, exact: Answer) -> tuple[float, int | None, int | None]:
    """The largest error of a time, the n-th event of a kind beside the n-th; how many are missed, how many are extra."""
    if found.events is None:
        return NONE, None, None
    errors, missed, extra = [NONE if exact.events else 0.0], 0, 0
    for kind in {kind for _, kind in (*exact.events, *found.events)}:
        ours, theirs = (sorted(t for t, each in events if each == kind) for events in (found.events, exact.events))
        errors += [abs(a - b) for a, b in zip(ours, theirs, strict=False)]
        missed, extra = missed + max(len(theirs) - len(ours), 0), extra + max(len(ours) - len(theirs), 0)
    return float(np.fmax.reduce(errors)), missed, extra


def gradient_scores(simulate: Simulator, case: Case, found: Simulated) -> tuple[GradientScore, ...]:
    """Each derivative by central differences of the simulator, and its own."""
    wanted, beside = case.exact.gradients, dict[str, list[Simulated | None]]()
    for each in wanted:
        if each.by not in beside:
            at = case.numbers.get(each.by, 0.0)
            beside[each.by] = [simulated(simulate, case.changed(**{each.by: at + s * each.step})) for s in (-1, 1)]
    own = found.gradients or (NONE,) * len(wanted)
    return tuple(
        GradientScore(each.of, each.by, each.value, by_differences(each, beside[each.by]), mine)
        for each, mine in zip(wanted, own, strict=True)
    )


def by_differences(wanted: Gradient, beside: Sequence[Simulated | None]) -> float:
    """A central difference; NaN where the value is not there at both ends."""
    low, high = (NONE if each is None else each.values.get(wanted.of, NONE) for each in beside)
    return (high - low) / (2.0 * wanted.step)


# ---- what a simulator returns ----


def simulated(simulate: Simulator, case: Case) -> Simulated | None:
    """What a simulator returns for a case, checked; HopformError for what it raises, and for what it may not return."""
    try:
        returned = simulate(case)
    except HopformError as error:
        raise HopformError(f"the simulator refuses the case {case.name}: {error}") from error
    except (Exception, SystemExit) as error:
        raise HopformError(f"the simulator raises {type(error).__name__} in the case {case.name}: {error}") from error
    if returned is None:
        return None
    parts: dict[Any, Any] = {"states": returned}
    if isinstance(returned, Mapping) and "states" in returned:
        parts = dict(cast(Any, returned))
        if unknown := [each for each in parts if each not in PARTS]:
            raise HopformError(f"case {case.name}: a simulator returns {', '.join(PARTS)}, got {shown(unknown[0])}")
    states = _states(case, parts["states"])
    values = {f"{name}_end": float(column[-1]) for name, column in states.items()} | _values(case, parts.get("values"))
    return Simulated(states, _events(case, parts.get("events")), values, _gradients(case, parts.get("gradients")))


def _states(case: Case, given: Any) -> dict[str, Floats]:
    """The columns of the states."""
    count = len(case.times)
    if isinstance(given, Mapping):
        if missing := [name for name in case.outputs if name not in given]:
            raise HopformError(f"case {case.name}: states lack {missing[0]}; outputs are {', '.join(case.outputs)}")
        columns = {name: _array(case, name, given[name], (count,)) for name in case.outputs}
    else:
        table = _array(case, "states", given, (count, len(case.outputs)))
        columns = dict(zip(case.outputs, table.T, strict=True))
    for name, column in columns.items():
        if (wrong := np.flatnonzero(~np.isfinite(column))).size:
            t, value = case.times[wrong[0]], column[wrong[0]]
            raise HopformError(f"case {case.name}: {name} must be finite, got {value} at t = {t:g} s")
    return columns


def _array(case: Case, name: str, given: Any, shape: tuple[int, ...]) -> Floats:
    try:
        made = np.array(given, float)
    except Exception:
        raise HopformError(f"case {case.name}: {name} must be numbers of shape {shape}, got {shown(given)}") from None
    if made.shape != shape:
        raise HopformError(f"case {case.name}: {name} must be of shape {shape}, got {made.shape}")
    return made


def _number(case: Case, name: str, given: Any) -> float:
    value = number_of(str(given)) if not isinstance(given, bool) else None
    if value is None or not math.isfinite(value):
        raise HopformError(f"case {case.name}: {name} must be a finite number, got {shown(given)}")
    return value


def _events(case: Case, given: Any) -> tuple[tuple[float, str], ...] | None:
    """Events as (time, kind)."""
    if given is None:
        return None
    found = list[tuple[float, str]]()
    try:
        pairs = [(t, kind) for t, kind in given]
    except Exception:
        raise HopformError(f"case {case.name}: events must be pairs (time, kind), got {shown(given)}") from None
    for t, kind in pairs:
        if not isinstance(kind, str):
            raise HopformError(f"case {case.name}: the kind of an event must be a text, got {shown(kind)}")
        found.append((_number(case, f"the time of {shown(kind)}", t), kind))
    return tuple(found)


def _values(case: Case, given: Any) -> dict[str, float]:
    """Values by name; None of one is none."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise HopformError(f"case {case.name}: values must be numbers by name, got {shown(given)}")
    named = dict(cast(Any, given))
    for name in named:
        if name not in case.values:
            raise HopformError(f"case {case.name} has no value {shown(name)}; known: {', '.join(case.values)}")
    return {str(name): _number(case, name, value) for name, value in named.items() if value is not None}


def _gradients(case: Case, given: Any) -> tuple[float, ...] | None:
    """A number for each derivative that the answer has; NaN or None for one that the simulator has not."""
    wanted = case_named(case.name).exact.gradients
    if given is None:
        return None
    try:
        found = tuple(NONE if each is None else float(each) for each in given)
    except Exception:
        raise HopformError(f"case {case.name}: gradients must be {len(wanted)} numbers, got {shown(given)}") from None
    if len(found) != len(wanted):
        names = ", ".join(f"d {each.of}/d {each.by}" for each in wanted)
        raise HopformError(f"case {case.name}: gradients must be {names}, got {len(found)} numbers")
    return found
