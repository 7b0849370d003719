"""Break the engine on purpose, one place at a time, and see a test fail: `python -m tests.mutation [WORD ...]`.

Each mutant is applied to a copy of the project, which is derived and compiled anew unless the mutant is about
staleness, and judged by the fast part of the tests, which import the copy. A mutant that no test notices survives:
then, or if the copy is red before anything is broken, the exit code is 1. A word picks the mutants that have it in
their names.
"""

import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tests.mutation.copies import COMPILED, DERIVED, TIME_LIMIT, Stillborn, copied, killed_by, run, tests

# The fast part of the tests, in the order in which they judge: random robots, wheels, plots, command lines are left
# out.
ALGEBRA = ("tests/unit/test_derivation.py", "tests/unit/test_certificate.py")
MOTION = (
    "tests/conformance/test_stance.py",
    "tests/conformance/test_ties.py",
    "tests/unit/test_properties.py",
    "tests/conformance/test_model_file.py",
)
HOUSE = ("tests/repository/test_house.py", "tests/unit/test_library.py")
CONTROL = ("tests/conformance/test_control_search.py",)


@dataclass(frozen=True)
class Mutant:
    """One place, broken: `old`, which stands there exactly once, becomes `new`."""

    name: str
    path: str
    old: str
    new: str
    after: tuple[tuple[str, ...], ...] = (DERIVED, COMPILED)
    first: tuple[str, ...] = ()

    @property
    def judges(self) -> tuple[str, ...]:
        """The files of tests, those first that are nearest to what is broken."""
        stale = HOUSE if self.after != (DERIVED, COMPILED) else ()
        order = (*self.first, *stale, *MOTION, *HOUSE, *ALGEBRA)
        return tuple(dict.fromkeys(order))

    def apply(self, tree: Path) -> None:
        target = tree / self.path
        text = target.read_text("utf-8")
        if (found := text.count(self.old)) != 1:
            raise Stillborn(f"{self.name}: what it replaces stands {found} times in {self.path}")
        target.write_text(text.replace(self.old, self.new), "utf-8")


@dataclass(frozen=True)
class Outcome:
    """By which test a mutant was killed, None if it survived, and what pytest printed."""

    mutant: Mutant | None
    killed_by: str | None
    seconds: float
    output: str


MUTANTS = (
    # ---- what is stale ----
    Mutant(
        "a stale library",
        "runtime/engine/c/stance_real.c",
        "/* The chain while it grows. */",
        "/* The chain as it grows. */",
        after=(DERIVED,),
        first=("tests/unit/test_library.py",),
    ),
    # ---- the controller ----
    Mutant(
        "controller, C: a root further out is as good",
        "runtime/engine/c/control_real.c",
        "return fabs_real(c->from.u) < fabs_real(search->best.u) && c->lower_bound < HOPFORM_REACHED_WITHIN_real;",
        "return fabs_real(c->from.u) > fabs_real(search->best.u) && c->lower_bound < HOPFORM_REACHED_WITHIN_real;",
        first=CONTROL,
    ),
    Mutant(
        "controller, C: nothing lies below the ends of a interval",
        "runtime/engine/c/control_real.c",
        "return end - DEPTH_real * c->width * spread_real(c);",
        "return end - 0.0 * DEPTH_real * c->width * spread_real(c);",
        first=CONTROL,
    ),
    Mutant(
        "controller, C: friction holds as a stop does",
        "runtime/engine/c/control_real.c",
        "&& !(push < 0.0 && search->start.x1 > robot->x1_min);",
        "&& !(push < 0.0 && search->start.x1 > robot->x1_max);",
        first=CONTROL,
    ),
    Mutant(
        "controller, C: the stroke has no margin",
        "runtime/engine/c/control_real.c",
        "robot->x1_max - wanted.stop_margin - 16.0 * HOPFORM_EPS_real",
        "robot->x1_max - 0.0 * wanted.stop_margin - 16.0 * HOPFORM_EPS_real",
        first=CONTROL,
    ),
    Mutant(
        "controller, C: half a interval is never tried",
        "runtime/engine/c/control_real.c",
        "        add_interval_real(search, trial, &split.to, fabs_real(split.to.u - trial->u) > half ? slower : 0);\n",
        "",
        first=CONTROL,
    ),
    Mutant(
        "C: what a stop takes from the contact force does not end the contact",
        "runtime/engine/c/stance_real.c",
        "if (!HOPFORM_CONTACT_IS_COMPRESSION && end.kind == STANCE_END_STOP_real\n",
        "if (HOPFORM_CONTACT_IS_COMPRESSION && end.kind == STANCE_END_STOP_real\n",
        first=("tests/conformance/test_leg.py",),
    ),
    Mutant(
        "derivation: a damper in the leg carries nothing",
        "derive/model/equations.py",
        "return y + sp.factor(sp.expand(leg.subs(x1, y + x2 - L0 - c))) / k",
        "return y + 0 * sp.factor(sp.expand(leg.subs(x1, y + x2 - L0 - c))) / k",
        first=("tests/conformance/test_leg.py",),
    ),
    Mutant(
        "controller, C: a stop that is hit counts for nothing",
        "runtime/engine/c/trial_real.h",
        "        if (stops && rate > 0.0) {\n",
        "        if (stops && rate < 0.0) {\n",
        first=CONTROL,
    ),
    Mutant(
        "controller, C: at a hit, the other velocity decides",
        "runtime/engine/c/trial_real.h",
        "const bool slow = height < contact;",
        "const bool slow = height > contact;",
        first=CONTROL,
    ),
    Mutant(
        "controller, NumPy: at a hit, the other velocity decides",
        "runtime/engine/numpy/trial.py",
        "slow = np.asarray(height < contact)",
        "slow = np.asarray(height > contact)",
        first=CONTROL,
    ),
    Mutant(
        "controller, C: take-off at a fixed time",
        "runtime/engine/c/trial_real.h",
        "const real late = -hopform_contact_slope_real(robot, &tally->change) / rate;",
        "const real late = -0.0 * hopform_contact_slope_real(robot, &tally->change) / rate;",
        first=CONTROL,
    ),
    Mutant(
        "controller, NumPy: take-off at a fixed time",
        "runtime/engine/numpy/trial.py",
        "late[good] = -formulas.contact_slope(robot, change)[good] / rate[good]",
        "late[good] = -0.0 * formulas.contact_slope(robot, change)[good] / rate[good]",
        first=CONTROL,
    ),
    Mutant(
        "controller, NumPy: a dip that is not at the turn",
        "runtime/engine/numpy/extrema.py",
        "return found, _turn(of.only(found), low, high)",
        "return found, 0.5 * (high + _turn(of.only(found), low, high))",
        first=("tests/conformance/test_control.py",),
    ),
    Mutant(
        "controller, NumPy: the stroke has no margin",
        "runtime/engine/numpy/control.py",
        "self.robot.x1_max - self.target.stop_margin",
        "self.robot.x1_max - 0.0 * self.target.stop_margin",
        first=CONTROL,
    ),
    Mutant(
        "controller, NumPy: what is wanted is far off",
        "runtime/engine/numpy/control.py",
        "return max(abs(self.gap) - 2.0 * self.near, 0.0)",
        "return max(0.5 * abs(self.gap) - 2.0 * self.near, 0.0)",
        first=CONTROL,
    ),
    # ---- what a mass does next ----
    Mutant(
        "C: a reversal taken for a stick",
        "runtime/engine/c/stance_real.c",
        "    stance_settle_real(chain, mass == 1, mass == 2);\n    const int side =",
        "    stance_settle_real(chain, mass == 1, mass == 2);\n"
        "    if (mass == 1 && chain->side_1 == -side_before) {\n        chain->side_1 = 0;\n    }\n"
        "    if (mass == 2 && chain->side_2 == -side_before) {\n        chain->side_2 = 0;\n    }\n"
        "    const int side =",
    ),
    Mutant(
        "NumPy: a reversal taken for a stick",
        "runtime/engine/numpy/stance.py",
        "    after = chain.side[mass - 1][lanes]\n",
        "    chain.side[mass - 1][lanes] *= chain.side[mass - 1][lanes] == before\n"
        "    after = chain.side[mass - 1][lanes]\n",
    ),
    Mutant(
        "C: a held mass heeds no friction",
        "runtime/engine/c/stance_real.c",
        "const real friction = mass == 1 ? robot->f1 : robot->f2;\n    const int towards",
        "const real friction = 0.0 * robot->f1;\n    const int towards",
    ),
    Mutant(
        "C: a held mass slips only to where its force does not go",
        "runtime/engine/c/stance_real.c",
        "if (side == -towards ||",
        "if (side == towards ||",
    ),
    Mutant(
        "C: a leg that two masses stretch alike is not watched",
        "runtime/engine/c/stance_real.c",
        "const bool may_fall = chain->side_1 < 0 || chain->side_2 > 0 || state->y < 0.0;",
        "const bool may_fall = chain->side_1 < 0 && chain->side_2 > 0;",
    ),
    Mutant(
        "C: a late take-off has the digits that the start and the rise leave it",
        "runtime/engine/c/stance_real.c",
        "n == 0 && sharpen_takeoff_real(chain, &events, limit, &in)",
        "n == 0 && sharpen_takeoff_real(chain, &events, 0.0, &in)",
    ),
    Mutant(
        "NumPy: a late take-off has the digits that the start and the rise leave it",
        "runtime/engine/numpy/stance.py",
        "moved = (correction != 0.0) & (t + correction <= on.limit[lanes])",
        "moved = (correction != 0.0) & (t + correction <= 0.0)",
    ),
    Mutant(
        "NumPy: a take-off comes before a stop that is hit earlier",
        "runtime/engine/numpy/stance.py",
        "lifts = (on.found[lanes] == 0) & (high <= on.high[lanes] * (1.0 + 8.0 * EPS[high.dtype]))",
        "lifts = on.found[lanes] == 0",
        first=("tests/conformance/test_checker.py",),
    ),
    Mutant(
        "C: an actuator without friction stays at its stop where its forces cancel",
        "runtime/engine/c/stance_real.c",
        "        keep_faint_acceleration_real(chain, motion, &end->basis);",
        "        (void)keep_faint_acceleration;",
        first=("tests/conformance/test_checker.py",),
    ),
    Mutant(
        "NumPy: an actuator without friction stays at its stop where its forces cancel",
        "runtime/engine/numpy/stance.py",
        "    if not slides.any():",
        "    if slides.any() or not slides.any():",
        first=("tests/conformance/test_checker.py",),
    ),
    Mutant(
        "C: a leg that rings about 0 is given up",
        "runtime/engine/c/stance_real.c",
        "if (rings && lift <= events->rest_time) {",
        "if (rings && lift < 0.0) {",
        first=("tests/conformance/test_checker.py",),
    ),
    Mutant(
        "NumPy: a leg that rings about 0 is given up",
        "runtime/engine/numpy/stance.py",
        "    if rings.any():",
        "    if not rings.size:",
        first=("tests/conformance/test_stance.py",),
    ),
    Mutant(
        "C: every minimum is held up by tangents",
        "runtime/engine/c/first_event_real.h",
        "return from->value + from->rate * reach > bound;",
        "return from->value + 0.0 * reach > bound;",
    ),
    Mutant(
        "NumPy: a held mass heeds no friction",
        "runtime/engine/numpy/stance.py",
        "friction - goal * acceleration",
        "0.0 * friction - goal * acceleration",
    ),
    Mutant(
        "C: a stop takes no energy",
        "runtime/engine/c/energy_real.c",
        "loss += energy_loss_before_real(plan, steps, phases, n + 1);",
        "loss += 0.0 * energy_loss_before_real(plan, steps, phases, n + 1);",
    ),
    Mutant(
        "NumPy: a stop at the start takes no energy",
        "runtime/engine/numpy/stance.py",
        "np.where(struck, -0.5 * robot.m_eff * v1 * v1, 0.0)",
        "np.where(struck, -0.0 * robot.m_eff * v1 * v1, 0.0)",
    ),
    Mutant(
        "C: an event moves without what its move brings",
        "runtime/engine/c/sensitivity_real.c",
        "change->at[i][column] += (before[i] - after[i]) * late;",
        "change->at[i][column] += 0.0 * (before[i] - after[i]) * late;",
        first=("tests/conformance/test_sensitivities.py",),
    ),
    Mutant(
        "NumPy: a stop that is moved is met where it was",
        "runtime/engine/numpy/sensitivity.py",
        "bound[hits, stop[hits]] = 1.0",
        "bound[hits, stop[hits]] = 0.0",
        first=("tests/conformance/test_sensitivities.py",),
    ),
    Mutant(
        "C: the distance to a stop is formed from x1",
        "runtime/engine/c/stance_real.c",
        "chain->from_min += moved.x1_t;",
        "chain->from_min = chain->state.x1 + moved.x1_t - chain->plan->robot.x1_min;",
        first=("tests/conformance/test_checker.py",),
    ),
    Mutant(
        "NumPy: the distance to a stop is formed from x1",
        "runtime/engine/numpy/stance.py",
        "chain.from_min, chain.from_max = chain.from_min + moved, chain.from_max + moved",
        "chain.from_min, chain.from_max = "
        "chain.state.x1 + moved - chain.plan.robot.x1_min, chain.state.x1 + moved - chain.plan.robot.x1_max",
        first=("tests/conformance/test_checker.py",),
    ),
    Mutant(
        "C: a stop that is touched where x1 turns is hit",
        "runtime/engine/c/first_event_real.h",
        "return beyond > 0.0 && beyond > grazing_tolerance_real(motion, start, basis);",
        "return beyond > 0.0;",
        first=("tests/conformance/test_ties.py",),
    ),
    # ---- the first event ----
    Mutant(
        "C: an event before the take-off at the same time",
        "runtime/engine/c/first_event_real.h",
        "(at->value < -8.0 * HOPFORM_EPS_real * limit * at->rate)",
        "(at->value < 8.0 * HOPFORM_EPS_real * limit * at->rate)",
        first=("tests/conformance/test_ties.py",),
    ),
    Mutant(
        "NumPy: an event before the take-off at the same time",
        "runtime/engine/numpy/events.py",
        "(at[0] < -8.0 * eps * limit * at[1])",
        "(at[0] < 8.0 * eps * limit * at[1])",
        first=("tests/conformance/test_ties.py",),
    ),
    Mutant(
        "C: a touch taken for a crossing",
        "runtime/engine/c/first_event_real.h",
        "if (!(least.value < -rounding_of_real(g, &lowest, least.rate))) {",
        "if (!(least.value < rounding_of_real(g, &lowest, least.rate))) {",
        first=("tests/conformance/test_ties.py",),
    ),
    Mutant(
        "C: rounding taken for a crossing",
        "runtime/engine/c/first_event_real.h",
        "((to->value < -rounding) | (is_last & (to->rate * h < -rounding)));",
        "(rounding >= 0.0 || is_last || h >= 0.0);",
        first=("tests/conformance/test_ties.py",),
    ),
    Mutant(
        "NumPy: a dip between two samples is not seen",
        "runtime/engine/numpy/events.py",
        "below = jet[0] < -rounding",
        "below = rounding < 0.0",
    ),
    Mutant(
        "NumPy: rounding taken for a crossing",
        "runtime/engine/numpy/events.py",
        "crossed = (on.end[0, slot, lane] < rounding)",
        "crossed = (on.end[0, slot, lane] < 0.0)",
        first=("tests/conformance/test_ties.py",),
    ),
    Mutant(
        "C: everything is quiet",
        "runtime/engine/c/first_event_real.h",
        "const real left = at->value - X - 1.001 * sqrt_real(X * X + wY * wY / ww) - rounding;",
        "const real left = at->value + fabs_real(X) - 0.0 * wY / ww - rounding;",
        first=("tests/conformance/test_model_file.py",),
    ),
    Mutant(
        "C: a mass that has just slipped may return at once",
        "runtime/engine/c/stance_real.c",
        "chain->fresh_1 = end->kind == END_THRESHOLD_1_real;",
        "chain->fresh_1 = false;",
    ),
    # ---- the kernels ----
    Mutant(
        "C: the split formula at every time",
        "runtime/engine/c/kernels_real.h",
        "if (chi * t * t >= 1.0) {",
        "if (chi * t * t >= 1.0e-9) {",
    ),
    Mutant(
        "C: a spread of the pair beyond the range of the exponential",
        "runtime/engine/c/kernels_real.h",
        "if (half * t >= 0.5) {",
        "if (half * t > 0.5) {",
        first=("tests/conformance/test_switchovers.py",),
    ),
    Mutant(
        "NumPy: factors of the cubic that are not polished",
        "runtime/engine/numpy/kernels.py",
        "for _ in range(3):",
        "for _ in range(0):",
        first=("tests/unit/test_certificate.py",),
    ),
    # ---- flight, touchdown ----
    Mutant(
        "C flight: a limit of the current that is not watched",
        "runtime/engine/c/flight_real.c",
        "        watch_level_real(chain, points, count, -1, -1, end);\n",
        "",
        first=("tests/conformance/test_flight.py",),
    ),
    Mutant(
        "C flight: a stop that is not met",
        "runtime/engine/c/flight_real.c",
        "if (hopform_is_finite_real(stop) && sign * (end->at.actuator.moved - way) > 0.0) {",
        "if (hopform_is_finite_real(stop) && sign * (end->at.actuator.moved - way) > 1.0e9) {",
        first=("tests/conformance/test_flight.py",),
    ),
    Mutant(
        "C flight: a foot that does not move with the actuator",
        "runtime/engine/c/flight_real.c",
        "chain->ballistic.foot = (chain->x1 - chain->actuator.x1) +",
        "chain->ballistic.foot = 0.0 * (chain->x1 - chain->actuator.x1) +",
        first=("tests/conformance/test_flight.py",),
    ),
    Mutant(
        "C flight: the turning points of the foot are not looked for",
        "runtime/engine/c/flight_real.c",
        "count = split_real(chain, FOOT_RATE_real, points, count);",
        "(void)split;",
        first=("tests/conformance/test_flight.py",),
    ),
    Mutant(
        "NumPy flight: a foot below a step up has been above it",
        "runtime/engine/numpy/flight.py",
        "chain.airborne = bool(foot > noise)",
        "chain.airborne = bool(foot > -1.0)",
        first=("tests/conformance/test_flight.py",),
    ),
    Mutant(
        "C touchdown: no hysteresis",
        "runtime/engine/c/touchdown_real.c",
        "(contact->above != 0 ? detector->low : detector->high)",
        "(contact->above != 2 ? detector->high : detector->low)",
        first=("tests/unit/test_touchdown.py",),
    ),
)


def main() -> int:
    chosen = [mutant for mutant in MUTANTS if not sys.argv[1:] or any(word in mutant.name for word in sys.argv[1:])]
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="hopform-mutants-") as folder:
        whole = copied(Path(folder, "unbroken"))
        survivors = report(judge_all([None, *chosen], whole))
    print(f"{len(chosen)} mutants, {survivors or 'none'} survived, {time.monotonic() - began:.0f} s")
    return 1 if survivors else 0


def judge_all(mutants: list[Mutant | None], whole: Path) -> Iterator[Outcome]:
    """The outcomes in order, two at a time or as many as there are processors for."""
    first = [file for mutant in mutants if mutant for file in mutant.first]
    sound = tuple(dict.fromkeys((*HOUSE, *ALGEBRA, *MOTION[:1], *first)))
    with ThreadPoolExecutor(max_workers=min(4, os.cpu_count() or 1)) as pool:
        yield from pool.map(partial(judge, whole=whole, sound=sound), mutants)


def report(outcomes: Iterator[Outcome]) -> int:
    """Print the table as it comes about; the number of survivors."""
    survivors = 0
    for outcome in outcomes:
        if outcome.mutant is None and outcome.killed_by is not None:
            raise Stillborn(f"the copy is red before anything is broken: {outcome.killed_by}\n{outcome.output}")
        survived = outcome.mutant is not None and outcome.killed_by is None
        survivors += survived
        name = outcome.mutant.name if outcome.mutant else "nothing is broken"
        verdict = outcome.killed_by or ("SURVIVED" if survived else "all green")
        print(f"{name:<54} {outcome.seconds:4.0f} s  {verdict}", flush=True)
    return survivors


def judge(mutant: Mutant | None, whole: Path, sound: tuple[str, ...]) -> Outcome:
    """Break a copy, make what follows from it, and run the tests up to the first that fails;
    `sound` if nothing is broken.
    """
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="hopform-mutant-") as folder:
        tree = Path(folder, "hopform")
        shutil.copytree(whole, tree, ignore=shutil.ignore_patterns("__pycache__"))
        if mutant:
            mutant.apply(tree)
            for command in mutant.after:
                run(tree, *command)
        done = tests(tree, mutant.judges) if mutant else tests(tree, sound, 4 * TIME_LIMIT)
    return Outcome(mutant, killed_by(done), time.monotonic() - began, done.stdout)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Stillborn as error:
        sys.exit(f"hopform: {error}")
