"""Random stances by the thousand or the million, each one certified: `make test-exhaustive N=1000000`.

C solves each stance; the checker (tests/oracle/checker) certifies the list of events and measures the errors.
What it cannot settle, what it disputes, what is inaccurate, and a sample drawn by the seed go
to the 50-digit reference. An error is divided by the condition number, max |q(p (1 + d)) - q(p)|/(d unit of q) over
outputs q and over inputs p, which are what the solvers are given: the robot, x1, v1, v2, the compression y, the
current. Exit code 1 if anything is wrong or stays unsettled, or if more than 0.1 % of the stances have a condition
above 1000.
"""

import argparse
import json
import math
import os
import secrets
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hopform_solver.records import ENDINGS, EVENTS
from tests.conformance.random_stances import MAX_PHASES, draw_stances, solve_with_c
from tests.oracle import reference
from tests.oracle.checker import CERTIFIED, PROBLEM, REASONS, ROBOT, certify

BATCH = 10000
TOLERANCE = 1e-12
# Of the reference's 50 digits ten are its error's, and the states after events may have lost twice as many again.
MORE_DIGITS = ((1e-20, 200), (1e-170, 1000))
RIGHT, BY_EVENT = "right", "right by the state at an event"
BESIDE = "right for a level of friction 32 ulp beside"
RIGHTS = (RIGHT, BY_EVENT, BESIDE)
HIGH_CONDITION, SHARE_OF_HIGH = 1e3, 1e-3
MODES = [f"({first:+d},{second:+d})" for first in (-1, 0, 1) for second in (-1, 0, 1)]


@dataclass
class Findings:
    """What was seen in a number of stances."""

    modes: Counter[int] = field(default_factory=Counter)
    events: Counter[int] = field(default_factory=Counter)
    endings: Counter[int] = field(default_factory=Counter)
    outcomes: Counter[int] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    stances: int = 0
    ill_conditioned: int = 0
    windows: int = 0
    worst: dict[str, float] = field(default_factory=dict)
    flagged: list[dict[str, Any]] = field(default_factory=list)  # for the reference

    def add(self, other: "Findings") -> None:
        for name in ("modes", "events", "endings", "outcomes", "reasons"):
            getattr(self, name).update(getattr(other, name))
        for name in ("stances", "ill_conditioned", "windows"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        for name, error in other.worst.items():
            self.worst[name] = max(error, self.worst.get(name, 0.0))
        self.flagged += other.flagged


def examine(seed: int, count: int, sampled: int) -> Findings:
    """Draw, solve and judge; the cases that need the reference are flagged with the reason."""
    p = draw_stances(seed, count)
    answers, phases = solve_with_c(p)
    v = certify(p, answers, phases)
    found = Findings(stances=count, windows=int(v["windows"].sum()))
    found.modes.update(phases["mode"].tolist())
    found.events.update(phases["event"][phases["event"] > 0].tolist())
    found.endings.update(answers["ending"].tolist())
    found.outcomes.update(v["outcome"].tolist())
    found.reasons.update(REASONS[r] for r in v["reason"] if r)
    sure = v["outcome"] == CERTIFIED
    state, aed = (v[f"error_{of}"] / np.fmax(1.0, v[f"condition_{of}"]) for of in ("state", "aed"))
    found.ill_conditioned = int((v["condition_state"][sure] > HIGH_CONDITION).sum())
    why: dict[int, str] = dict.fromkeys(
        np.random.default_rng(seed).choice(count, sampled, replace=False).tolist(), "sample"
    )
    for name, error in (("state", state), ("aed", aed)):
        found.worst[name] = float(error[sure].max(initial=0.0))
        why |= dict.fromkeys(np.flatnonzero(sure & ~(error <= TOLERANCE)).tolist(), f"error of {name}")
    why |= {i: REASONS[v["reason"][i]] for i in np.flatnonzero(~sure).tolist()}
    for i, reason in why.items():
        found.flagged.append(case_of(p[i], answers[i], phases, reason, seed, i))
    return found


def case_of(p: Any, answer: Any, phases: Any, reason: str, seed: int, lane: int) -> dict[str, Any]:
    """A stance with the answer of the library, as it can be written down and solved again."""
    mine = phases[answer["first"] : answer["first"] + answer["count"]]
    return {
        "why": reason,
        "seed": seed,
        "lane": lane,
        "problem": {name: float(p[name]) for name in PROBLEM.names or ()},
        "ending": ENDINGS[int(answer["ending"])],
        "events": [(float(q["t"]), EVENTS[int(q["event"])]) for q in mine if q["event"]],
        "end": {name: float(answer[name]) for name in ("duration", "x1", "v1", "v2", "y", "aed")},
    }


def problem_of(values: dict[str, float]) -> Any:
    """A problem as an array of one PROBLEM; what is left out is 0."""
    p = np.zeros(1, PROBLEM)
    for name, value in values.items():
        p[name] = value
    return p


def solved_exactly(robot: dict[str, float], start: dict[str, Any]) -> reference.Reference:
    """The reference's stance; again with more digits where what decides between two lists of events is below what the
    former ones tell.
    """
    exact = reference.solve(robot, **start)
    for margin, digits in MORE_DIGITS:
        if not exact.margin > margin:
            exact = reference.solve(robot, digits=digits, **start)
    return exact


def refer(case: dict[str, Any]) -> dict[str, Any]:
    """The same case with the verdict of the reference: `verdict` is right, wrong events, or inaccurate."""
    p = case["problem"]
    robot = {name: p[name] for name in ROBOT}
    start: dict[str, Any] = {name: p[name] for name in ("v2", "x1", "v1", "u", "horizon")} | {"max_phases": MAX_PHASES}
    if p["y"]:
        start["y"] = p["y"]
    exact = solved_exactly(robot, start)
    kept = exact.events[: MAX_PHASES - 1]
    case["expected"] = {
        "ending": exact.status,
        "events": [(float(e.time), e.kind) for e in kept],
        "margin": float(exact.margin),
    }
    beside = not answers_with(exact, case)
    if beside:
        exact = next((each for each in neighbours(robot, start) if answers_with(each, case)), exact)
        kept = exact.events[: MAX_PHASES - 1]
        if not answers_with(exact, case):
            case["verdict"] = "wrong events"
            return case
    unit = reference.scales(robot, exact, p["v2"])
    end, final = case["end"], exact.final
    x2 = end["x1"] - end["y"] + p["L0"] + p["c"]
    errors = [(end["duration"] - exact.duration) / unit["time"], (x2 - final.x2) / unit["position"]]
    errors += [(time - e.time) / unit["time"] for (time, _), e in zip(case["events"], kept, strict=True)]
    errors += [(end["x1"] - final.x1) / unit["position"], end["v1"] - final.v1, end["v2"] - final.v2]
    case["errors"] = {
        "state": max(abs(float(e)) for e in errors),
        "aed": abs(float((end["aed"] - exact.aed) / unit["energy"])),
    }
    case["conditions"] = {}
    for of, error in case["errors"].items():
        if error > TOLERANCE:
            condition = reference.condition(robot, of=of, **start)
            if of == "aed" and not math.isfinite(condition):
                # A tie that breaks wherever an input is moved alone; all masses, forces and coefficients together scale
                # the AED.
                condition = abs(float(exact.aed / unit["energy"]))
            case["conditions"][of] = condition
            case["errors"][of] = error / max(1.0, condition) if math.isfinite(condition) else error
    case["verdict"] = "right" if max(case["errors"].values()) <= TOLERANCE else "inaccurate"
    if case["verdict"] == "inaccurate" and case["errors"]["aed"] <= TOLERANCE:
        onward = max(onward_conditions(p, {name: float(value) for name, value in unit.items()}), default=1.0)
        case["conditions"]["state at an event"] = onward
        if max(abs(float(e)) for e in errors) <= TOLERANCE * onward:
            case["verdict"] = BY_EVENT
    if beside and case["verdict"] != "inaccurate":
        case["verdict"] = BESIDE
    return case


def answers_with(exact: reference.Reference, case: dict[str, Any]) -> bool:
    """Whether the reference has the ending and the events of a case."""
    kinds = [event.kind for event in exact.events[: MAX_PHASES - 1]]
    return exact.status == case["ending"] and kinds == [kind for _, kind in case["events"]]


def neighbours(robot: dict[str, float], start: dict[str, Any]) -> Iterator[reference.Reference]:
    """The stances of a mass that starts at rest with its friction at rest 32 ulp higher or lower; of no other start."""
    for level, speed in (("f1", "v1"), ("f2", "v2")):
        for ulps in (-32.0, 32.0) if start[speed] == 0.0 else ():
            factor = 1.0 + ulps * sys.float_info.epsilon
            levels = {name: robot[name] * factor for name in (level, f"{level}_excess")}
            yield solved_exactly(robot | levels, start)


MOVED = ("x1", "v1", "v2", "y")
NUDGE = 1e-13  # some hundred times the rounding of what is moved


def onward_conditions(p: dict[str, float], unit: dict[str, float]) -> Iterator[float]:
    """How much the rounding of x1, v1, v2 or y at each event moves what comes after it, in the units of the errors.

    A stance that goes on from the state that it has returned at an event cannot know more than that state says: where y
    or x1 comes back to where it was, the condition by the inputs does not show it. Differences of stances of the C back
    end.
    """
    start = problem_of(p)
    for phase in solve_with_c(start)[1][1:]:
        again = np.repeat(start, 1 + len(MOVED))
        again["horizon"] -= phase["t"]
        for n, name in enumerate(MOVED, 1):
            again[name] = phase[name]
            again[name][n] *= 1.0 + NUDGE
        again["x1"] = np.clip(again["x1"], again["x1_min"], again["x1_max"])
        answers, phases = solve_with_c(again)
        parts = [phases[a["first"] : a["first"] + a["count"]] for a in answers]
        for answer, part in zip(answers[1:], parts[1:], strict=True):
            if len(part) == len(parts[0]) and (part["event"] == parts[0]["event"]).all():
                moved = [np.abs(part["t"] - parts[0]["t"]).max() / unit["time"]]
                moved += [abs(answer["duration"] - answers[0]["duration"]) / unit["time"]]
                moved += [abs(answer[of] - answers[0][of]) / unit["position"] for of in ("x1", "y")]
                moved += [abs(answer[of] - answers[0][of]) / unit["velocity"] for of in ("v1", "v2")]
                yield float(max(moved)) / NUDGE


def share(pool: ProcessPoolExecutor, what: str, work: Any, jobs: list[tuple[Any, ...]], quiet: bool) -> Any:
    """Results as they come, with progress on stderr."""
    begun = time.monotonic()
    for done, future in enumerate(as_completed([pool.submit(work, *job) for job in jobs]), 1):
        yield future.result()
        if not quiet and (done == len(jobs) or sys.stderr.isatty() or done % max(1, len(jobs) // 20) == 0):
            print(f"{what}: {done}/{len(jobs)}, {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)


def table(found: Findings, referred: list[dict[str, Any]]) -> str:
    """What was seen and how it was judged, as text."""
    verdicts = Counter(case["verdict"] for case in referred)
    disputed = [case for case in referred if case["why"] != "sample"]
    rows = [
        ("phases per mode", {name: found.modes[n] for n, name in enumerate(MODES)}),
        ("events", {word: found.events[n] for n, word in EVENTS.items()}),
        ("endings", {word: found.endings[n] for n, word in ENDINGS.items()}),
        ("checker", {word: found.outcomes[n] for n, word in enumerate(("certified", "unsettled", "disputed"))}),
        ("not certified for", dict(found.reasons)),
        ("to the reference", {"sample": len(referred) - len(disputed), "flagged": len(disputed)}),
        ("it says", {word: verdicts[word] for word in (*RIGHTS, "wrong events", "inaccurate")}),
        ("worst error / condition", {name: f"{error:.2e}" for name, error in found.worst.items()}),
        (f"condition above {HIGH_CONDITION:g}", {"stances": found.ill_conditioned,
                                                 "share": f"{found.ill_conditioned / found.stances:.2%}"}),
    ]  # fmt: skip
    return "\n".join(f"{name:>24}: " + ", ".join(f"{key} {value}" for key, value in row.items()) for name, row in rows)


def run(
    seed: int, count: int, sampled: int, processes: int, quiet: bool = False
) -> tuple[Findings, list[dict[str, Any]]]:
    """Examine `count` stances, send what is flagged and `sampled` more to the reference."""
    sizes = [min(BATCH, count - first) for first in range(0, count, BATCH)]
    samples = np.diff(np.round(np.linspace(0, min(sampled, count), len(sizes) + 1)).astype(int)).tolist()
    jobs = [(seed + n, size, min(size, some)) for n, (size, some) in enumerate(zip(sizes, samples, strict=True))]
    found = Findings()
    with ProcessPoolExecutor(processes) as pool:
        for part in share(pool, "batches", examine, jobs, quiet):
            found.add(part)
        referred = list(share(pool, "reference", refer, [(case,) for case in found.flagged], quiet))
    return found, sorted(referred, key=lambda case: (case["seed"], case["lane"]))


def solved_again(case: dict[str, Any]) -> dict[str, Any]:
    """A case that was written down, solved by the engine of today and judged by the reference."""
    p = problem_of(case["problem"])
    answers, phases = solve_with_c(p)
    return refer(case_of(p[0], answers[0], phases, "once wrong", case["seed"], case["lane"]))


def main() -> None:
    arguments = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    arguments.add_argument("--count", type=int, default=1_000_000)
    arguments.add_argument(
        "--reference", type=int, default=2000, help="how many certified ones the reference solves too"
    )
    arguments.add_argument("--seed", type=int, default=None, help="fresh if left out")
    arguments.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    arguments.add_argument("--cases", default=None, help="a JSON file for the cases that are wrong")
    arguments.add_argument("--replay", default=None, help="solve the cases of such a file again instead")
    chosen = arguments.parse_args()
    if chosen.replay:
        again = [solved_again(case) for case in json.loads(Path(chosen.replay).read_text())]
        for case in again:
            print(f"{case['verdict']}: seed {case['seed']} lane {case['lane']} {case.get('errors', '')}")
        sys.exit(any(case["verdict"] not in RIGHTS for case in again))
    seed = secrets.randbelow(2**31) if chosen.seed is None else chosen.seed
    print(f"{chosen.count} stances, seed {seed} (--seed {seed} repeats them)", flush=True)
    begun = time.monotonic()
    found, referred = run(seed, chosen.count, chosen.reference, chosen.processes)
    print(table(found, referred))
    print(f"{time.monotonic() - begun:.0f} s, {found.windows / found.stances:.1f} windows per stance")
    wrong = [case for case in referred if case["verdict"] not in RIGHTS]
    for case in wrong[:20]:
        print(f"{case['verdict']} ({case['why']}): seed {case['seed']} lane {case['lane']} {case.get('errors', '')}")
    if chosen.cases and wrong:
        Path(chosen.cases).parent.mkdir(exist_ok=True)
        Path(chosen.cases).write_text(json.dumps(wrong, indent=1) + "\n")
    too_many = found.ill_conditioned > max(1.0, SHARE_OF_HIGH * found.stances)
    if too_many:
        print(
            f"a condition above {HIGH_CONDITION:g} in more than {SHARE_OF_HIGH:.1%} of them: the draw does not say much"
        )
    sys.exit(1 if wrong or too_many else 0)


if __name__ == "__main__":
    main()
