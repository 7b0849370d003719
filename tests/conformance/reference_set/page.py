"""`make reference`: score the simulators of the page, and write docs/evidence/reference-set.md."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

from hopform.reference import Score, cases, score
from tests.conformance.reference_set.simulators import SIMULATORS, in_mujoco

PAGE = Path(__file__).resolve().parents[3] / "docs" / "evidence" / "reference-set.md"
FORM = ".3g"
MARKS = "<!-- {} -->", "<!-- end of {} -->"


def number(value: float) -> str:
    return format(value, FORM) if math.isfinite(value) else "-"


def table(head: Sequence[str], rows: Iterable[Sequence[str]], words: int = 1) -> str:
    """A table of which the first columns are words."""
    lines = [head, [*["---"] * words, *["--:"] * (len(head) - words)], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def of_cases() -> str:
    """What each case is, and how much its answer has."""
    return table(
        ("case", "what it is", "equations of motion", "MJCF", "URDF", "events", "derivatives", "margin"),
        [
            (
                f"`{case.name}`", case.title, case.family, *(case.without[name] or "yes" for name in ("mjcf", "urdf")),
                str(len(case.exact.events)), str(len(case.exact.gradients)), format(case.margin, ".2g"),
            )
            for case in cases()
        ],
        5,
    )  # fmt: skip


def over_simulators(scores: dict[str, tuple[Score, ...]], what: str, of: Callable[[Score], float]) -> str:
    """A row per case, a column per simulator."""
    rows = []
    for n, case in enumerate(cases()):
        found = [of(each[n]) for each in scores.values()]
        if any(map(math.isfinite, found)):
            rows.append((f"`{case.name}`", f"{scores['hopform'][n].unit}{what}", *map(number, found)))
    return table(("case", "unit", *scores), rows, 2)


def of_derivatives(scores: dict[str, tuple[Score, ...]]) -> str:
    """The exact derivative, and each simulator's differences."""
    rows = [
        (f"`{case.name}`", f"{wanted.of} by {wanted.by}", format(wanted.value, ".6g"),
         *(f"{each[n].gradients[k].differences:.6g}" if math.isfinite(each[n].gradients[k].differences) else "-" for each in scores.values()))
        for n, case in enumerate(cases())
        for k, wanted in enumerate(case.exact.gradients)
    ]  # fmt: skip
    return table(("case", "derivative", "exact", *scores), rows, 2)


def worst(scores: tuple[Score, ...]) -> str:
    """The largest error of hopform in any case: of states, events, derivatives by itself relative to 1 or their size."""
    states = max(max(each.rms, each.rms_velocity) for each in scores)
    events = max(each.event_error for each in scores)
    own = [g for each in scores for g in each.gradients if math.isfinite(g.own)]
    slopes = max(abs(g.own - g.exact) / max(abs(g.exact), 1.0) for g in own)
    return (
        f"hopform's rms errors are at most {states:.1e} in SI units, its events are right to {events:.1e} s and none is\n"
        f"missed or extra. Its own derivatives are right to {slopes:.1e}, relative to the larger of 1 and their size."
    )


def parts() -> dict[str, str]:
    """What stands between the marks of the page, by their names."""
    scores = {name: score(simulate) for name, simulate in SIMULATORS.items()}
    assert all(each.missed == each.extra == 0 for each in scores["hopform"])
    return {
        "cases": of_cases(),
        "positions": over_simulators(scores, "", lambda each: each.rms),
        "velocities": over_simulators(scores, "/s", lambda each: each.rms_velocity),
        "creep": over_simulators(scores, "/s", lambda each: each.creep),
        "derivatives": of_derivatives(scores),
        "hopform": worst(scores["hopform"]),
        "stiffer": stiffer(),
        "versions": versions(),
    }


def stiffer() -> str:
    """The creep of MuJoCo in `hold` where its friction is as stiff as it takes."""
    found = {}
    for timestep in (2e-3, 1e-3, 1e-4):
        simulate = partial(in_mujoco, integrator="EULER", timestep=timestep, stiffer=True)
        (found[timestep],) = score(simulate, "hold")
    shown = ", ".join(f"{each.creep:{FORM}} rad/s at {1e3 * timestep:g} ms" for timestep, each in found.items())
    return f"Where `solreffriction` of MuJoCo is two time steps, its creep in `hold` is {shown}."


def versions() -> str:
    import mujoco

    return f"MuJoCo {mujoco.__version__}, default constraints (`solref`, `solimp`) everywhere."


def filled(text: str, found: dict[str, str]) -> str:
    """The page with these parts between its marks."""
    for name, part in found.items():
        begin, end = (mark.format(name) for mark in MARKS)
        before, _, rest = text.partition(begin)
        _, _, after = rest.partition(end)
        assert rest and after, name
        text = f"{before}{begin}\n{part}\n{end}{after}"
    return text


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text("utf-8"), parts()), "utf-8")
