"""The judge of answers: mixed stability, an error divided by the condition number of what was asked.

    error = max |answer - exact|/scale      condition = max over outputs of sum over p |p d output/dp|/scale
    right: the events are the exact ones, or a neighbour's, and error/max(1, condition) <= 1e-12 (float32: 1e-5)

p are all inputs, and the state at the start of each later phase. Zeros stay zero, and inputs that are tied and equal
stay equal.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from .equations import Problem
from .neighbour import Neighbour, neighbour, scaled
from .numbers import TINY, Number, Real, exact, mp
from .solution import Solution, solve

STEP = mp.mpf("1e-25")  # relative, of the differences
LIMITS = {53: 1e-12, 24: 1e-5}  # by binary digits
RIGHT, EXCUSED, WRONG = "right", "excused", "wrong"


@dataclass(frozen=True)
class Answer:
    """What the product says: ending, duration, events (time, kind), outputs at the end, gains of energies."""

    status: str
    duration: Number
    events: Sequence[tuple[Number, str]]
    final: Mapping[str, Number]
    gains: Mapping[str, Number]

    @property
    def kinds(self) -> tuple[str, ...]:
        return (*(kind for _, kind in self.events), self.status)


@dataclass(frozen=True)
class Verdict:
    """right, excused (the events are a neighbour's) or wrong; errors in units of the scales, by part.

    `condition` is computed where an error is above the limit, or if it is asked for; without it, `ratio` is the error,
    else error/max(1, condition). Each part is judged by its own condition; `joint` divides by the largest of them.
    """

    outcome: str
    errors: Mapping[str, float]
    condition: Mapping[str, float]
    ratio: float
    joint: float
    exact: Solution
    neighbour: Neighbour | None


def compare(source: Problem | Mapping[str, Any], answer: Answer, digits: int = 53, condition: bool = False) -> Verdict:
    """The verdict on an answer in floats with so many binary digits."""
    solution, near = capped(solve(source), answer), None
    if solution.kinds != answer.kinds:
        near = neighbour(solution.problem, answer.kinds, digits)
        if near.solution is None:
            return Verdict(WRONG, {}, {}, float("inf"), float("inf"), solution, near)
    other = near.solution if near is not None and near.solution is not None else solution
    errors, limit = errors_of(other, answer), LIMITS[digits]
    known: dict[str, float] = {}
    if condition or any(not error <= limit for error in errors.values()):
        known = conditions(other)
    ratio = max(error / max(1.0, known.get(part, 1.0)) for part, error in errors.items())
    joint = max(errors.values()) / max(1.0, *known.values(), 1.0)
    outcome = WRONG if not ratio <= limit else RIGHT if near is None else EXCUSED
    return Verdict(outcome, errors, known, ratio, joint, solution, near)


def capped(solution: Solution, answer: Answer) -> Solution:
    """The motion up to where the answer was given up: a cap counts the phases of whoever has it."""
    if answer.status != "too_many_phases" or len(answer.events) > len(solution.events):
        return solution
    most = next((n for n, phase in enumerate(solution.phases) if phase.before == len(answer.events)), 0)
    return solve(replace(solution.problem, max_phases=most)) if most else solution


def scale(solution: Solution, part: str) -> Real:
    """The unit of an output; times count from the duration on, if that is longer than the declared unit."""
    unit = solution.system.units[part]
    return max(unit, solution.duration) if part == "time" else unit


def errors_of(solution: Solution, answer: Answer) -> dict[str, float]:
    """Errors of the answer: of times and outputs (`state`), and of each energy that it gives."""
    unit = scale(solution, "time")
    states = [abs(exact(answer.duration) - solution.duration) / unit]
    states += [abs(exact(t) - event.time) / unit for (t, _), event in zip(answer.events, solution.events, strict=True)]
    final, gains = solution.final, solution.gains
    states += [abs(exact(value) - final[name]) / scale(solution, name) for name, value in answer.final.items()]
    energies = {name: abs(exact(q) - gains[name]) / scale(solution, name) for name, q in answer.gains.items()}
    return {part: float(error) for part, error in {"state": max(states), **energies}.items()}


def outcome(solution: Solution, base: Solution, start: Real = mp.zero) -> dict[str, list[Real]]:
    """What is judged, in units of the base solution: times, outputs; energies gained, or for later phases reached."""
    unit = scale(base, "time")
    times = [(start + t) / unit for t in (*(event.time for event in solution.events), solution.duration)]
    states = [q / scale(base, name) for name, q in solution.final.items() if name in base.system.units]
    energies = solution.energies(solution.duration) if start else solution.gains
    parts = {name: [q / scale(base, name)] for name, q in energies.items() if name in base.system.units}
    return {"state": [*states, *times], **parts}


def conditions(base: Solution) -> dict[str, float]:
    """The condition numbers, of the state and of each energy; inf if every small move changes the events."""
    sums: dict[str, list[Real]] = {}
    problems = [(base.problem, mp.zero, base.problem.groups()), *later_phases(base)]
    for problem, start, groups in problems:
        here = solve(problem)
        wanted = outcome(here, base, start)
        for group in groups:
            moved = moved_solution(here, group)
            if moved is None:
                return dict.fromkeys(wanted, float("inf"))
            for part, values in outcome(moved, base, start).items():
                change = [abs(p - q) / STEP for p, q in zip(values, wanted[part], strict=True)]
                old = sums.get(part, [mp.zero] * len(change))
                skip = len(old) - len(change)  # events before a later phase do not depend on its start
                sums[part] = [*old[:skip], *(p + q for p, q in zip(old[skip:], change, strict=True))]
    return {part: float(max(values)) for part, values in sums.items()}


def moved_solution(here: Solution, group: Sequence[str]) -> Solution | None:
    """The solution with inputs moved up or down, whichever keeps the events."""
    for factor in (1 + STEP, 1 - STEP):
        try:
            moved = solve(scaled(here.problem, group, factor))
        except ValueError:  # off the model: out of the stroke
            continue
        if moved.kinds == here.kinds:
            return moved
    return None


def later_phases(base: Solution) -> Iterator[tuple[Problem, Real, list[tuple[str, ...]]]]:
    """The problem that begins where a phase does, the time, and the parts of its start that may be moved."""
    problem, outputs = base.problem, base.system.outputs
    for phase in base.phases[1:]:
        state = {name: outputs[name].at(phase.point.q, phase.point.v) for name in problem.start}
        steps = [(max(t - phase.start, mp.zero), u) for t, u in problem.steps]
        first = max(n for n, (t, _) in enumerate(steps) if t == 0)
        equations = problem.equations
        if "contact" in equations:  # a leg may be longer than free in mid-motion, where a damper or a spring holds on
            equations = {**equations, "contact": {**equations["contact"], "tolerance": "inf"}}
        again = replace(
            problem,
            equations=equations,
            start=state,
            steps=tuple(steps[first:]),
            horizon=problem.horizon - phase.start,
            max_phases=problem.max_phases - base.phases.index(phase),
        )
        ties = {name: set(names) for names in problem.equations.get("tied", ()) for name in names}
        free = [name for name, value in state.items() if value and not stuck(name, value, ties, again)]
        yield again, phase.start, [(name,) for name in free]


def stuck(name: str, value: Real, ties: Mapping[str, set[str]], problem: Problem) -> bool:
    """Whether a part of the state sits on a limit, with which it moves."""
    limits = [problem.parameters[other] for other in ties.get(name, ()) if other in problem.parameters]
    return any(mp.isfinite(limit) and abs(limit - value) <= TINY * abs(value) for limit in limits)
