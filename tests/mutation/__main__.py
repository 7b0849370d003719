"""Break the house on purpose, one place at a time, and see a test fail: `python -m tests.mutation [WORD ...]`.

Each mutant is applied to a copy of the project, which is derived and compiled anew unless the mutant is about
staleness, and judged by the fast part of the tests, which import the copy. A mutant that no test notices survives:
then, or if the copy is red before anything is broken, the exit code is 1. A word picks the mutants that have it in
their names.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LEFT_OUT = (".*", "__pycache__", "out", "dist", "build")
TIME_LIMIT = 600
"""[s] of a processor, so that a machine with other work to do gives no other verdict; ten times that by the clock."""

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
HOPPING = ("tests/unit/test_hopping.py", "tests/conformance/test_hops.py")
CONTROL = ("tests/conformance/test_control_search.py",)
NEAREST = {
    "derive": ALGEBRA + MOTION + HOUSE,
    "templates": MOTION + HOUSE + ALGEBRA,
    "runtime": MOTION + HOUSE + ALGEBRA,
}
LEFT_OUT_TESTS = "not random and not page"

DERIVED = ("-m", "derive")
COMPILED = ("tools/build_library.py",)
IDENTIFICATION = ("tests/unit/test_rigs.py",)
RECORDED = ("tests/unit/test_recordings.py",)
ESTIMATED = ("tests/unit/test_estimation.py",)


@dataclass(frozen=True)
class Mutant:
    """One place, broken: `old`, which stands there exactly once, becomes `new`;
    a file that is not there yet has no old.
    """

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
        order = (*self.first, *stale, *NEAREST.get(self.path.split("/")[0], HOUSE + MOTION + ALGEBRA))
        return tuple(dict.fromkeys(order))

    def apply(self, tree: Path) -> None:
        target = tree / self.path
        text = target.read_text("utf-8") if target.is_file() else ""
        found = text.count(self.old) if self.old else int(not target.is_file())
        if found != 1:
            raise Stillborn(f"{self.name}: what it replaces stands {found} times in {self.path}")
        target.write_text(text.replace(self.old, self.new) if self.old else self.new, "utf-8")


class Stillborn(Exception):
    """Nothing to judge: the unbroken copy is red, or a mutant's place is not there, or nothing compiles from it."""


@dataclass(frozen=True)
class Outcome:
    """By which test a mutant was killed, None if it survived, and what pytest printed."""

    mutant: Mutant | None
    killed_by: str | None
    seconds: float
    output: str


MUTANTS = (
    # ---- what the paper prints and what follows ----
    Mutant(
        "(14) with the printed sign of b_1 gamma/m_eff",
        "derive/maths/laplace.py",
        "columns = [list(rate), middle, list(lowest)]",
        "columns = [list(rate), [*middle[:2], middle[2] + 2 * a1_v1 * C_2], list(lowest)]",
    ),
    Mutant(
        "(8) with f_2/m_s, in the drive",
        "derive/maths/laplace.py",
        "Step(C_2, a2_0 - f2 * side_2,",
        'Step(C_2, a2_0 - f2 * side_2 / sp.Symbol("m_s", real=True),',
    ),
    Mutant("(8) with f_2/m_s, in the model", "derive/model/equations.py", "- m_s * f2 * side_2\n", "- f2 * side_2\n"),
    Mutant("(24) with the printed plus", "derive/maths/energy.py", "viscous_2: -b2 * v2**2,", "viscous_2: b2 * v2**2,"),
    Mutant(
        "the ledger with a swapped sign", "derive/maths/energy.py", "motor_work: -gamma2 * u", "motor_work: gamma2 * u"
    ),
    Mutant(
        "(18) with another sign in chi",
        "derive/maths/partial_fractions.py",
        "Step(chi, q - a * (p - a),",
        "Step(chi, q + a * (p - a),",
    ),
    Mutant("a drop without its impact", "derive/maths/control.py", "(1 - impact_loss)", "(1 - 0 * impact_loss)"),
    Mutant("f_2 in N", "derive/model/quantities.py", 'Quantity("f2", r"f_2", "m/s^2"', 'Quantity("f2", r"f_2", "N"'),
    # ---- what is stale ----
    Mutant(
        "a hand edit that changes no number",
        "generated/python/hopform_solver/formulas.py",
        "C_2 = a2_0 - f2*side_2 ",
        "C_2 = a2_0 - side_2*f2 ",
        after=(),
    ),
    Mutant("a stray file", "generated/python/hopform_solver/extra.py", "", '"""No template makes this."""\n', after=()),
    Mutant(
        "a stale library",
        "runtime/engine/c/stance_real.c",
        "/* The chain while it grows. */",
        "/* The chain as it grows. */",
        after=(DERIVED,),
        first=("tests/unit/test_library.py",),
    ),
    Mutant("a stale derivation", "derive/maths/laplace.py", "a2_0 - f2 * side_2", "a2_0 + f2 * side_2", after=()),
    # ---- the controller ----
    Mutant(
        "controller, C: a root further out is as good",
        "runtime/engine/c/control_real.c",
        "return fabs_real(c->from.u) < fabs_real(search->best.u) && c->promise < HOPFORM_REACHED_WITHIN_real;",
        "return fabs_real(c->from.u) > fabs_real(search->best.u) && c->promise < HOPFORM_REACHED_WITHIN_real;",
        first=CONTROL,
    ),
    Mutant(
        "controller, C: nothing lies below the ends of a cell",
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
        "controller, C: half a cell is never tried",
        "runtime/engine/c/control_real.c",
        "        keep_real(search, trial, &split.to, fabs_real(split.to.u - trial->u) > half ? slower : 0);\n",
        "",
        first=CONTROL,
    ),
    Mutant(
        "controller, C: a stop that is hit counts for nothing",
        "runtime/engine/c/trial_real.h",
        "    if (stops && rate > 0.0) {\n",
        "    if (stops && rate < 0.0) {\n",
        first=CONTROL,
    ),
    Mutant(
        "controller, C: at a hit, the other velocity decides",
        "runtime/engine/c/trial_real.h",
        "if (height < met->y) {",
        "if (height > met->y) {",
        first=CONTROL,
    ),
    Mutant(
        "controller, NumPy: at a hit, the other velocity decides",
        "runtime/engine/numpy/trial.py",
        "slow = np.asarray(height < at.y)",
        "slow = np.asarray(height > at.y)",
        first=CONTROL,
    ),
    Mutant(
        "controller, C: take-off at a fixed time",
        "runtime/engine/c/trial_real.h",
        "const real late = -tally->change.y / speed.y;",
        "const real late = -0.0 * tally->change.y / speed.y;",
        first=CONTROL,
    ),
    Mutant(
        "controller, NumPy: take-off at a fixed time",
        "runtime/engine/numpy/trial.py",
        "late[good] = -change.y[good] / speed.y[good]",
        "late[good] = -0.0 * change.y[good] / speed.y[good]",
        first=CONTROL,
    ),
    Mutant(
        "controller, NumPy: a dip that is not at the turn",
        "runtime/engine/numpy/trial.py",
        "t = _turn(found, low, high, rate[row, look], rate[row, look + 1])",
        "t = 0.5 * _turn(found, low, high, rate[row, look], rate[row, look + 1]) + 0.5 * high",
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
        "if (!rings && (chain->side_1 < 0 || chain->side_2 > 0 || state->y < 0.0)) {",
        "if (!rings && chain->side_1 < 0 && chain->side_2 > 0) {",
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
        "np.where(t + later <= limit[where], later, 0.0)",
        "np.where(t + later <= 0.0, later, 0.0)",
    ),
    Mutant(
        "NumPy: a stop that is hit with the leg at rest is a take-off",
        "runtime/engine/numpy/stance.py",
        "(end.kind[lanes] != LIMIT) & (end.kind[lanes] != STOP)",
        "(end.kind[lanes] != LIMIT)",
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
        "    if not rings.any():\n        return lift\n",
        "    if rings.size:\n        return lift\n",
        first=("tests/conformance/test_checker.py",),
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
        "start = friction[lanes] - side * free[lanes]",
        "start = 0.0 * friction[lanes] - side * free[lanes]",
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
        "the current's own share in how the accelerations change",
        "derive/maths/sensitivity.py",
        "(*model.robot.symbols, u), SLOPES.symbols",
        "model.robot.symbols, SLOPES.symbols",
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
        "runtime/engine/c/stance_real.c",
        "!(beyond > grazing_tolerance_real(events->motion, &start, &at.basis))",
        "false",
        first=("tests/conformance/test_ties.py",),
    ),
    Mutant(
        "W is carried without the fourth order",
        "derive/maths/time_domain.py",
        "sixth * rates[2] + rest * rates[3]",
        "sixth * rates[2]",
        first=("tests/unit/test_certificate.py",),
    ),
    # ---- the first event ----
    Mutant(
        "C: an event before the take-off at the same time",
        "runtime/engine/c/stance_real.c",
        "at->value < -8.0 * HOPFORM_EPS_real * limit * at->rate",
        "at->value < 8.0 * HOPFORM_EPS_real * limit * at->rate",
        first=("tests/conformance/test_ties.py",),
    ),
    Mutant(
        "NumPy: an event before the take-off at the same time",
        "runtime/engine/numpy/stance.py",
        "lifts = lift <= end.t[lanes] * (1.0 + end.tie)",
        "lifts = lift <= end.t[lanes] * (1.0 - 64.0 * end.tie)",
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
        "return to->value < -rounding || (in->found < 0 && to->rate * (in->high.t - in->low) < -rounding);",
        "return rounding >= 0.0;",
        first=("tests/conformance/test_ties.py",),
    ),
    Mutant(
        "NumPy: a dip between two samples is not seen",
        "runtime/engine/numpy/events.py",
        "crosses[dips] = bottom.value < -bottom.noise",
        "crosses[dips] = bottom.value < -1.0e9 * bottom.noise",
    ),
    Mutant(
        "NumPy: a touch taken for a crossing",
        "runtime/engine/numpy/events.py",
        "crosses[dips] = bottom.value < -bottom.noise",
        "crosses[dips] = bottom.value < bottom.noise",
        first=("tests/conformance/test_ties.py",),
    ),
    Mutant(
        "NumPy: rounding taken for a crossing",
        "runtime/engine/numpy/events.py",
        "crosses = (here.value < 0.0) & ((here.value < -here.noise) | steep)",
        "crosses = here.value < 0.0",
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
    # ---- identification ----
    Mutant(
        "identification: a preload that gravity does not balance",
        "runtime/hopform/_identify/rigs.py",
        'by["k"] = by["k"] + by["g"] * preload / mass',
        'by["k"] = by["k"] + 0.0 * preload / mass',
        first=IDENTIFICATION,
        after=(),
    ),
    Mutant(
        "identification: a touchdown that does not move with the actuator",
        "runtime/hopform/_identify/hopping.py",
        "late = (by[2] - by[0] - _LENGTH_BY) / -(rates[2] - rates[0])",
        "late = (by[2] - by[0] - _LENGTH_BY) / -rates[2]",
        first=IDENTIFICATION,
        after=(),
    ),
    Mutant(
        "identification: steps of the current that move with an event",
        "runtime/hopform/_identify/hopping.py",
        "if run.begin_by.any() else []",
        "if False else []",
        first=IDENTIFICATION,
        after=(),
    ),
    Mutant(
        "identification: an impact that takes its share of the velocity",
        "runtime/hopform/_identify/hopping.py",
        "kept = math.sqrt(1.0 - robot.impact_loss)",
        "kept = 1.0 - robot.impact_loss",
        first=IDENTIFICATION,
        after=(),
    ),
    Mutant(
        "identification: time that may stand still",
        "runtime/hopform/_identify/recordings.py",
        "if not bool((steps > 0.0).all()):",
        "if not bool((steps >= 0.0).all()):",
        first=RECORDED,
        after=(),
    ),
    Mutant(
        "identification: a fall that is not held to g",
        "runtime/hopform/_identify/drop.py",
        "if not g / 3.0 < found < 3.0 * g:",
        "if not found < 3000.0 * g:",
        first=RECORDED,
        after=(),
    ),
    Mutant(
        "identification: a robust loss that is none",
        "runtime/hopform/_identify/estimation.py",
        '    if loss != "linear":\n        cost, slope, _',
        '    if loss == "none":\n        cost, slope, _',
        first=("tests/unit/test_identification.py::test_a_robust_loss_withstands_outliers",),
        after=(),
    ),
    Mutant(
        "identification: one side with the quantile of two",
        "runtime/hopform/_identify/estimation.py",
        "return 0.0, _cross(growth, value, stderr, one, math.inf)",
        "return 0.0, _cross(growth, value, stderr, two, math.inf)",
        first=ESTIMATED,
        after=(),
    ),
    Mutant(
        "identification: intervals that forget the degrees of freedom",
        "runtime/hopform/_identify/estimation.py",
        "float(psi @ psi) / solution.freedom / slope",
        "float(psi @ psi) / solution.count / slope",
        first=ESTIMATED,
        after=(),
    ),
    Mutant(
        "identification: directions that are listed without being identifiable",
        "runtime/hopform/_identify/estimation.py",
        "unseen = singular <= _WEAK * singular[0]",
        "unseen = singular < 0.0 * singular[0]",
        first=ESTIMATED,
        after=(),
    ),
    Mutant(
        "identification: a quantum that is the largest step",
        "runtime/hopform/_identify/recordings.py",
        "smallest = float(steps[0])",
        "smallest = float(steps[-1])",
        first=RECORDED,
        after=(),
    ),
    Mutant(
        "identification: gaps without a warning",
        "runtime/hopform/_identify/recordings.py",
        "np.flatnonzero(steps > 2.5 * usual)",
        "np.flatnonzero(steps > 1e9 * usual)",
        first=("tests/unit/test_identification.py::test_uneven_time_stamps_and_a_gap_do_no_harm",),
        after=(),
    ),
    Mutant(
        "identification: a velocity that is a difference of samples",
        "runtime/hopform/_identify/filtering.py",
        "gain = (1j * turn * rate) ** derivative",
        "gain = (1j * np.sin(turn) * rate) ** derivative",
        first=ESTIMATED,
        after=(),
    ),
    Mutant(
        "identification: a decay that noise releases",
        "runtime/hopform/_identify/segments.py",
        "start = int((np.abs(values - rest) >= reach - 8.0 * noise).argmax())",
        "start = int(np.abs(values - rest).argmax())",
        first=ESTIMATED,
        after=(),
    ),
    # ---- flight, hopping, maps, touchdown ----
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
        "flight: an impact without its loss",
        "derive/maths/flight.py",
        "sp.sqrt(1 - impact_loss)",
        "sp.sqrt(1 - 0 * impact_loss)",
        first=("tests/conformance/test_flight.py",),
    ),
    Mutant(
        "flight: a pickle that any library reads",
        "runtime/hopform/_solver/c_flight.py",
        "    if source != library.source:\n",
        "    if not source:\n",
        after=(),
        first=("tests/unit/test_run_object.py",),
    ),
    Mutant(
        "hopping: ground that stays where it was",
        "runtime/hopform/_hopping/run.py",
        "flight = _flight(task, state, None if index and step == 0.0 else step)",
        "flight = _flight(task, state, None if index else step)",
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "hopping: what is left of the return is forgotten",
        "runtime/hopform/_hopping/run.py",
        "task.plant, x1=state.x1, v1=state.v1, v2=state.v2, u=u,",
        "task.plant, x1=state.x1, v2=state.v2, u=u,",
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "hopping: energy predicted without the spring's coordinate",
        "runtime/hopform/_hopping/run.py",
        "level += hop.stance.aed - robot.k * float(hop.stance.end.x1) ** 2 / 2.0",
        "level += hop.stance.aed",
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "hopping: a touchdown seen without its delay",
        "runtime/hopform/_hopping/run.py",
        "return max(tick, 0.0) + errors.delay",
        "return max(tick, 0.0)",
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "hopping: noise of the ground that is that of the velocity",
        "runtime/hopform/_hopping/run.py",
        "ground + errors.ground * noise[3]",
        "ground + errors.ground * noise[2]",
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "terrain: lines counted from 0",
        "runtime/hopform/terrain.py",
        "csv.reader(text.splitlines()), 1)",
        "csv.reader(text.splitlines()), 0)",
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "hopping: energies over the ground under the foot",
        "runtime/hopform/_hopping/run.py",
        "found[0, inside] = energy.body + weight * leg.ground",
        "found[0, inside] = energy.body",
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "hopping: a robot that trips only stops",
        "runtime/hopform/_hopping/run.py",
        'status = "tripped" if flight.status == "tripped" else "stopped"',
        'status = "stopped"',
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "hopping: a set point below ground that is higher than level 0",
        "runtime/hopform/controllers.py",
        "if wanted < ground:",
        "if wanted < min(ground, 0.0):",
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "hopping: no gravity",
        "runtime/hopform/_hopping/run.py",
        "if not checked_robot(robot).g > 0.0:",
        "if not checked_robot(robot).g >= 0.0:",
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "terrain: none at all",
        "runtime/hopform/terrain.py",
        "    if not heights:\n",
        "    if heights is None:\n",
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "terrain: no hop",
        "runtime/hopform/terrain.py",
        'return (finite("height", height, "m"),) * whole("hops", hops)',
        'return (finite("height", height, "m"),) * whole("hops", hops, 0)',
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "the first controller's maps of drops, not of steady hopping",
        "runtime/hopform/controllers.py",
        "for _ in range(SETTLING):",
        "for _ in range(0):",
        after=(),
        first=HOPPING,
    ),
    Mutant(
        "(26) as printed, with the sign of the step",
        "runtime/hopform/_control/printed.py",
        "rise = (-level if signed else abs(level))",
        "rise = (-level if signed else -level)",
        after=(),
        first=("tests/conformance/test_control.py",),
    ),
    Mutant(
        "maps: a jump taken for a fixed point",
        "runtime/hopform/_control/reach.py",
        "return points if points and abs(gain) <= _CLOSED else []",
        "return points if points else []",
        after=(),
        first=("tests/unit/test_reachability.py",),
    ),
    Mutant(
        "maps: a multiplier without the impact",
        "runtime/hopform/_control/reach.py",
        "* robot.g * (1.0 - robot.impact_loss) / v2",
        "* robot.g / v2",
        after=(),
        first=("tests/unit/test_reachability.py",),
    ),
    Mutant(
        "maps: a stroke without its margin",
        "runtime/hopform/_control/reach.py",
        "return robot.x1_max - margin if",
        "return robot.x1_max if",
        after=(),
        first=("tests/unit/test_reachability.py",),
    ),
    Mutant(
        "maps: two currents side by side taken for a gap",
        "runtime/hopform/_control/reach.py",
        "jumps = np.flatnonzero(np.diff(lifts) > 1)",
        "jumps = np.flatnonzero(np.diff(lifts) > 0)",
        after=(),
        first=("tests/unit/test_reachability.py",),
    ),
    Mutant(
        "C touchdown: no hysteresis",
        "runtime/engine/c/touchdown_real.c",
        "(contact->above != 0 ? detector->low : detector->high)",
        "(contact->above != 2 ? detector->high : detector->low)",
        first=("tests/unit/test_touchdown.py",),
    ),
    Mutant(
        "touchdown: a step of the signal that comes with a sample",
        "runtime/hopform/_hopping/touchdown.py",
        "return self.dt * (self._samples(deviation, height) - 0.5)",
        "return self.dt * (self._samples(deviation, height) - 1.0)",
        after=(),
        first=("tests/unit/test_touchdown.py",),
    ),
    Mutant(
        "touchdown: samples in a row that need not be in a row",
        "runtime/hopform/_hopping/touchdown.py",
        "whole = stays ** (self.count - 1)",
        "whole = stays",
        after=(),
        first=("tests/unit/test_touchdown.py",),
    ),
)


def main() -> int:
    chosen = [mutant for mutant in MUTANTS if not sys.argv[1:] or any(word in mutant.name for word in sys.argv[1:])]
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="hopform-mutants-") as folder:
        whole = Path(folder, "unbroken")
        shutil.copytree(ROOT, whole, ignore=shutil.ignore_patterns(*LEFT_OUT))
        for command in (DERIVED, COMPILED):
            run(whole, *command)
        assert_imports_the_copy(whole)
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


def run(tree: Path, *command: str) -> None:
    done = python(tree, *command)
    if done.returncode != 0:
        raise Stillborn(f"python {' '.join(command)} fails:\n{done.stdout}{done.stderr}")


def tests(tree: Path, files: tuple[str, ...], limit: int = TIME_LIMIT) -> subprocess.CompletedProcess[str]:
    present = [file for file in files if (tree / file.partition("::")[0]).is_file()]
    options = ["-x", "-q", "--tb=short", "-rfE", "-p", "no:cacheprovider", "-k", LEFT_OUT_TESTS]
    return python(tree, "-m", "pytest", *options, *present, limit=limit)


def killed_by(done: subprocess.CompletedProcess[str]) -> str | None:
    """The test that failed, None if none did; tests that cannot be run are no verdict."""
    if done.returncode == 0:
        return None
    if done.returncode == TIMED_OUT:
        return f"no answer in {TIME_LIMIT} s"
    failed = re.findall(r"^(?:FAILED|ERROR) tests/(.+?)(?: - .*)?$", done.stdout, flags=re.MULTILINE)
    if done.returncode != 1 or not failed:
        raise Stillborn(f"pytest ends with {done.returncode}:\n{done.stdout}{done.stderr}")
    return str(failed[0])


TIMED_OUT = -1


def python(tree: Path, *arguments: str, limit: int = TIME_LIMIT) -> subprocess.CompletedProcess[str]:
    """This interpreter in a copy, whose packages come before those that are installed; stopped at a limit [s]."""
    paths = [str(tree / "runtime"), str(tree / "generated" / "python"), str(tree)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths), "PYTHONDONTWRITEBYTECODE": "1"}
    command = ["sh", "-c", f'ulimit -S -t {limit}; exec "$@"', "sh", sys.executable, *arguments]
    try:
        done = subprocess.run(
            command, cwd=tree, env=environment, capture_output=True, text=True, timeout=10 * limit, check=False
        )
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, TIMED_OUT, "", "")
    if done.returncode == -signal.SIGXCPU:
        done.returncode = TIMED_OUT
    return done


def assert_imports_the_copy(tree: Path) -> None:
    """Else every mutant would survive, or be killed, for nothing."""
    where = (
        "import derive, hopform, hopform_solver as s; print(derive.__file__, hopform.__file__, s.__file__, sep='\\n')"
    )
    files = python(tree, "-c", where).stdout.splitlines()
    if len(files) != 3 or not all(Path(file).resolve().is_relative_to(tree.resolve()) for file in files):
        raise Stillborn(f"the copy in {tree} is not what is imported: {files}")


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Stillborn as error:
        sys.exit(f"hopform: {error}")
