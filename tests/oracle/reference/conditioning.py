"""How errors are scaled, and how much of an input's rounding an exact answer shows.

condition = max over inputs p of max over outputs q of |q(p (1 + d)) - q(p)|/(d scale_q),   d = 1e-25
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from .records import Number, Real, exact, mp, parse_current, parse_robot
from .stance import Reference, solve

DIFFERENCE = "1e-25"
NO_INPUTS = ("name", "u", "horizon", "max_phases")
STROKE = ("x1", "x1_min", "x1_max")


def scales(robot: Mapping[str, Number], reference: Reference, v2: Number) -> dict[str, Real]:
    """The units of the accuracy measure: time, position, velocity, energy."""
    r = parse_robot(robot)
    return {
        "time": max(reference.duration, mp.sqrt(r.m_s / r.k)),
        "position": mp.mpf(1) / 10,
        "velocity": mp.one,
        "energy": r.m_s * max(abs(exact(v2)), 1) ** 2 / 2,
    }


def outcome(reference: Reference, units: Mapping[str, Real], of: str) -> list[Real]:
    """Times of the ending and of all events, and the state, in those units; or the AED: judged by its own condition."""
    if of == "aed":
        return [reference.aed / units["energy"]]
    s = reference.final
    return [
        reference.duration / units["time"],
        s.x1 / units["position"],
        s.v1 / units["velocity"],
        s.x2 / units["position"],
        s.v2 / units["velocity"],
        *(event.time / units["time"] for event in reference.events),
    ]


def perturbed(
    robot: Mapping[str, Number], arguments: Mapping[str, Any]
) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """The problem with each input moved in turn; a position at a stop moves with it."""
    factor = 1 + mp.mpf(DIFFERENCE)
    start = {"x1": 0, **{name: value for name, value in arguments.items() if value is not None}}
    values = {name: exact(q) for name, q in {**start, **robot}.items() if name not in NO_INPUTS}
    u = parse_current(arguments.get("u", 0))
    groups = {
        frozenset(
            other
            for other in values
            if other == name or ({name, other} <= set(STROKE) and values[other] == values[name])
        )
        for name in values
    }
    for names in groups:
        moved = {name: values[name] * factor for name in names}
        if all(mp.isfinite(q) and q for q in moved.values()):
            yield (
                {**robot, **{n: q for n, q in moved.items() if n in robot}},
                {**arguments, **{n: q for n, q in moved.items() if n not in robot}},
            )
    for place, (_, value) in enumerate(u):
        if value:
            yield dict(robot), {**arguments, "u": [(t, q * factor if i == place else q) for i, (t, q) in enumerate(u)]}


def condition(robot: Mapping[str, Number], **arguments: Any) -> float:
    """The condition number of the outcome, `of` "state" or "aed"; inf if the events change under the perturbation."""
    digits, of = arguments.pop("digits", 50), arguments.pop("of", "state")
    with mp.workdps(digits + 30):
        base = solve(robot, digits=digits, **arguments)
        units = scales(robot, base, arguments["v2"])
        answer, worst = outcome(base, units, of), mp.zero
        for other_robot, other in perturbed(robot, arguments):
            reference = solve(other_robot, digits=digits, **other)
            if kinds(reference) != kinds(base):
                return float("inf")
            moved = outcome(reference, units, of)
            worst = max(worst, *(abs(p - q) for p, q in zip(answer, moved, strict=True)))
        return float(worst / mp.mpf(DIFFERENCE))


def kinds(reference: Reference) -> tuple[str, tuple[str, ...]]:
    """Ending and event kinds."""
    return reference.status, tuple(event.kind for event in reference.events)
