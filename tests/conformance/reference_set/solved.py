"""The answer to a case, from the oracle, and the JSON that says it.

A derivative is a central difference with a step of 1e-20 at 90 digits, so it is right to some 38.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.conformance.reference_set.cases import Case, Steps, flight
from tests.oracle.mechanism import Solution, solve
from tests.oracle.mechanism.numbers import Real, exact, mp

FOLDER = Path(__file__).resolve().parents[3] / "runtime" / "hopform" / "_reference" / "data"
DIGITS = 17
STEP = mp.mpf(10) ** -20
LEAST_HELD = 0.1
"""[s] A time at rest that is shorter is no test of creep."""
LICENCE = "CC0-1.0"


@dataclass(frozen=True)
class Answer:
    """A solved case. events and held in s from its start; `margin` as the oracle has it, the least of its parts."""

    parts: tuple[tuple[Real, Solution], ...]
    events: tuple[tuple[Real, str], ...]
    ending: str
    duration: Real
    held: tuple[tuple[str, Real, Real], ...]
    margin: Real

    def at(self, t: float) -> dict[str, Real]:
        """The state at a time; at an event after it."""
        begin, solution = [part for part in self.parts if part[0] <= exact(t)][-1]
        return solution.at(exact(t) - begin)


def answer(case: Case, moved: Mapping[str, Real] | None = None) -> Answer:
    """The motion of a case with some of its numbers moved."""
    by = moved or {}
    p = {name: exact(each.value) + by.get(name, 0) for name, each in case.parameters.items()}
    start = {name: exact(each.value) + by.get(name, 0) for name, each in case.start.items()}
    steps = [(t, exact(u) + by.get(case.input.name, 0)) for t, u in case.input.steps]
    if case.family == "hop":
        return hop(case, p, start, steps)
    horizon = 2.0 if case.family == "stance" else case.horizon
    solution = solve(case.problem(p, start, steps, horizon))
    assert solution.duration >= exact(case.horizon) or solution.status == "rest"
    return joined(((mp.zero, solution),))


def hop(case: Case, p: dict[str, Real], start: dict[str, Real], steps: Steps) -> Answer:
    """Flight, stance, flight: each begins with the state that the one before has left."""
    first = solve(flight(p, start, steps, 2.0))
    landed = dict(first.final)
    landed["v2"] *= mp.sqrt(1 - p["loss"])
    landed["x2"] = landed["x1"] + p["L"]
    second = solve(case.problem(p, landed, steps, 2.0))
    third = solve(flight(p, dict(second.final), steps, 2.0))
    assert (first.status, second.status, third.status) == ("touchdown", "takeoff", "touchdown")
    times = mp.zero, first.duration, first.duration + second.duration
    return joined(tuple(zip(times, (first, second, third), strict=True)))


def joined(parts: tuple[tuple[Real, Solution], ...]) -> Answer:
    """The parts as one motion: endings of all but the last are events."""
    events, last = list[tuple[Real, str]](), parts[-1]
    for begin, solution in parts:
        events += [(begin + event.time, event.kind) for event in solution.events]
        if solution is not last[1] or solution.status in ("takeoff", "touchdown"):
            events.append((begin + solution.duration, solution.status))
    held = tuple(span for begin, solution in parts for span in held_in(begin, solution))
    margin = min(solution.margin for _, solution in parts)
    return Answer(parts, tuple(events), last[1].status, last[0] + last[1].duration, held, margin)


def held_in(begin: Real, solution: Solution) -> list[tuple[str, Real, Real]]:
    """The times in which an element is held: its name, from and to; a motion that came to rest is held from then on."""
    found = list[tuple[str, Real, Real]]()
    phases = solution.phases
    ends = [*(phase.start for phase in phases[1:]), mp.inf if solution.status == "rest" else solution.duration]
    for number, element in enumerate(solution.system.elements):
        since = None
        for phase, end in zip(phases, ends, strict=True):
            if phase.mode.signs[number]:
                since = None
                continue
            if since is None:
                since = phase.start
                found.append((element.name, begin + since, begin + end))
            else:
                found[-1] = (element.name, begin + since, begin + end)
    return found


def instants(case: Case) -> list[float]:
    count = round(case.horizon / case.every)
    return [round(n * case.every, 6) for n in range(count + 1)]


def value(case: Case, solved: Answer, name: str) -> Real:
    """A value of the answer by its name."""
    if name.endswith("_end"):
        return solved.at(case.horizon)[name.removesuffix("_end")]
    if name == "time_to_rest":
        assert solved.ending == "rest"
        return solved.duration
    if name == "apex":
        state = next(s for _, s in solved.parts if s.status == "takeoff")
        p, end = state.problem.parameters, state.final
        return end["x2"] + end["v2"] ** 2 / (2 * p["g"]) - p["L"]
    return [t for t, kind in solved.events if kind == name][-1]


def rests(case: Case, solved: Answer) -> list[dict[str, Any]]:
    """From the first instant in the later half of each long time at rest to the last in it."""
    found, times = list[dict[str, Any]](), instants(case)
    for name, begin, end in solved.held:
        inside = [t for t in times if begin < exact(t) < end or exact(t) == begin == 0]
        if inside and inside[-1] - inside[0] >= LEAST_HELD:
            later = [t for t in inside if t >= (inside[0] + inside[-1]) / 2]
            found.append({"of": name, "from": later[0], "to": later[-1]})
    return found


UNITS = {"time_to_rest": "s", "takeoff": "s", "touchdown": "s", "apex": "m"}


def data(case: Case) -> dict[str, Any]:
    """What the file of a case says; numbers of the answer are texts that `written` prints as numbers."""
    solved = answer(case)
    times = instants(case)
    states = [solved.at(t) for t in times]
    velocities = {velocity: f"{unit}/s" for unit, velocity in case.coordinates.values()}
    units = {name: unit for name, (unit, _) in case.coordinates.items()} | velocities
    outputs = [name for pair in case.coordinates.items() for name in (pair[0], pair[1][1])]
    columns = sorted({each.by for each in case.gradients})
    moved = {by: [answer(case, {by: sign * STEP}) for sign in (-1, 1)] for by in columns}

    def derivative(of: str, by: str) -> Real:
        low, high = moved[by]
        assert [k for _, k in low.events] == [k for _, k in high.events] == [k for _, k in solved.events]
        return (value(case, high, of) - value(case, low, of)) / (2 * STEP)

    return {
        "format": 1,
        "licence": LICENCE,
        "name": case.name,
        "title": case.title,
        "description": case.description,
        "family": case.family,
        "equations": list(case.equations),
        "coordinates": [{"name": n, "unit": unit, "velocity": v} for n, (unit, v) in case.coordinates.items()],
        "parameters": {name: each._asdict() for name, each in case.parameters.items()},
        "start": {name: each._asdict() for name, each in case.start.items()},
        "input": case.input._asdict(),
        "times": times,
        "margin": float(mp.nstr(solved.margin, 2)),
        "answer": {
            "states": {name: [number(state[name]) for state in states] for name in outputs},
            "events": [{"time": number(t), "kind": kind} for t, kind in solved.events],
            "ending": solved.ending,
            "rests": rests(case, solved),
            "values": {
                name: {"value": number(value(case, solved, name)), "unit": UNITS.get(name) or units[name[:-4]]}
                for name in case.values
            },
            "gradients": [{**each._asdict(), "value": number(derivative(each.of, each.by))} for each in case.gradients],
        },
        "mjcf": case.mjcf or None,
        "urdf": case.urdf or None,
    }


def number(x: Real) -> str:
    """A number in 17 digits, marked as one."""
    return f"@{mp.nstr(x, DIGITS) if x else '0.0'}@"


def written(of: Mapping[str, Any]) -> str:
    """The text of a file: a line for each entry of the first two levels that is no table, long lists in lines."""
    text = json.dumps(of, indent=1)
    text = re.sub(r'"@([^"@]*)@"', r"\1", text)

    def flat(match: re.Match[str]) -> str:
        return " ".join(match[0].split()).replace("[ ", "[").replace(" ]", "]").replace("{ ", "{").replace(" }", "}")

    text = re.sub(r"\{[^{}\[\]]*\}", flat, text)
    text = re.sub(r"\[[^\[\]{}\"]*\]", flat, text)
    return text + "\n"
