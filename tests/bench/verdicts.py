"""How good an answer is: its event list against the reference's, and its largest scaled error.

    time/max(T, sqrt(m_s/k))   position/0.1 m   velocity/(1 m/s)   energy/(m_s max(|v2|, 1 m/s)^2/2)

divided by the condition number of the stance where that is above 1.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hopform_solver.records import ENDINGS, EVENTS
from tests.bench.jobs import HEAD, Jobs


@dataclass(frozen=True)
class Verdict:
    """`wrong`: stances whose ending or event list is not the reference's. `error`: the largest of the others."""

    wrong: int
    error: float


def events_of(row: NDArray[np.float64]) -> list[tuple[float, str]]:
    """The event list of an answer."""
    pairs = row[len(HEAD) : len(HEAD) + 2 * int(row[7])].reshape(-1, 2)
    return [(float(time), EVENTS[int(kind)]) for time, kind in pairs]


def is_right(row: NDArray[np.float64], exact: dict[str, Any]) -> bool:
    """Whether ending and kinds of events are those of the reference."""
    kinds = [kind for _, kind in events_of(row)]
    return ENDINGS.get(int(row[0])) == exact["status"] and kinds == [kind for _, kind in exact["events"]]


def error(jobs: Jobs, n: int, row: NDArray[np.float64], exact: dict[str, Any]) -> float:
    """The largest scaled difference of times, state and AED; inf where something is not finite."""
    robot, x1, y = jobs.robot(n), row[2], row[5]
    x2 = x1 - y + robot["L0"] + robot["c"]
    end = exact["end"]
    scaled = [
        (row[1] - exact["duration"]) / exact["time_unit"],
        (x1 - end[0]) / 0.1,
        row[3] - end[1],
        (x2 - end[2]) / 0.1,
        row[4] - end[3],
        *(
            (ours - theirs[0]) / exact["time_unit"]
            for (ours, _), theirs in zip(events_of(row), exact["events"], strict=True)
        ),
    ]
    of_state, of_aed = (max(1.0, condition) for condition in exact["condition"])
    aed = (row[6] - exact["aed"]) / exact["energy_unit"]
    largest = max(float(np.max(np.abs(scaled))) / of_state, abs(aed) / of_aed)
    return largest if np.isfinite(largest) else float("inf")


def assess(jobs: Jobs, answers: NDArray[np.float64], truth: list[dict[str, Any]]) -> Verdict:
    """Count what is wrong and measure the rest."""
    errors = [
        error(jobs, n, row, exact)
        for n, (row, exact) in enumerate(zip(answers, truth, strict=False))
        if is_right(row, exact)
    ]
    return Verdict(len(answers) - len(errors), max(errors, default=float("nan")))
