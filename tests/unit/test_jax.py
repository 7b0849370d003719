"""Motions as functions of JAX: its transformations against closed forms, the oracle, loops and each other. What needs JAX
runs at night.
"""

import dataclasses
import doctest
import math
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

import hopform
import hopform.jax
from tests import needs
from tests.derived import SHIPPED, solver_of
from tests.oracle import mechanism
from tests.oracle.mechanism import builders
from tests.oracle.mechanism.numbers import mp

known_until = hopform.jax._known_until
PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "gradients-in-jax.md"
HOPPER = hopform.load_robot("hopper_c")


def night(test: Any) -> Any:
    """A test that runs where JAX is, at night."""
    return needs.jax(pytest.mark.nightly(test))


@pytest.fixture(scope="module")
def jax() -> Any:
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    return jax


@pytest.fixture(scope="module")
def joint(store) -> Any:
    return solver_of(store, SHIPPED / "joint.py")


# ---- without JAX ----


def test_without_jax_the_extra_is_named():
    for make in (lambda: hopform.jax.ending(HOPPER), lambda: hopform.jax.states(HOPPER, [0.1])):
        with pytest.raises(hopform.MissingExtra, match="needs the extra `jax`"), patch.dict(sys.modules, {"jax": None}):
            make()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"start": {"y_2": 0.1}}, "the model hopper has no coordinate 'y_2'"),
        ({"start": {"v2": float("nan")}}, "start v2 must be finite m/s, got nan"),
        ({"start": {"v2": [-1.0, -2.0]}}, "start v2 must be a number, got shape \\(2,\\); vmap maps it over many"),
        ({"u": [1.0, 2.0]}, "u must be a number, or with u_times one for each step, got shape \\(2,\\)"),
        ({"u": [1.0, 2.0], "u_times": [0.0, 0.1, 0.2]}, "u must have a number for each of 3 u_times, got shape \\(2,\\)"),
        ({"u_times": [0.1, 0.2]}, "u_times\\[0\\] must be 0 s"),
        ({"u_times": [0.0, 0.2, 0.2]}, "u_times\\[2\\] must be"),
        ({"horizon": 0.0}, "horizon must be > 0 s, got 0.0"),
        ({"grazing": "ignore"}, "grazing must be one of nan, one-sided, got 'ignore'"),
        ({"dtype": "float16"}, "dtype must be float64 or float32, got 'float16'"),
        ({"threads": 0}, "threads must be a whole number >= 1, got 0"),
        ({"max_phases": 0}, "max_phases must be a whole number >= 1, got 0"),
    ],
)  # fmt: skip
def test_what_a_function_is_made_of_is_checked_when_it_is_made(settings, message):
    with pytest.raises(hopform.HopformError, match=message):
        hopform.jax.ending(HOPPER, **settings)


@pytest.mark.parametrize("times", [[], [[0.1]], [-0.1], [float("inf")]])
def test_times_are_checked_when_a_function_is_made(times):
    with pytest.raises(hopform.HopformError, match="times"):
        hopform.jax.states(HOPPER, times)


# ---- derivatives ----


def spin_down(x: Any) -> tuple[Any, Any]:
    """Time and angle of J w' = -b w - F from w0 to rest."""
    J, b, F, w0 = (x[name] for name in ("J", "b", "F_p", "q_dot"))
    log = mp.log(1 + b * w0 / F)
    return J / b * log, J * w0 / b - F * J / b**2 * log


@night
def test_the_gradient_of_a_spin_down_is_that_of_its_closed_form(jax, joint):
    """Forty digits; what is left is rounding, of an angle whose condition number is below 4."""
    end = hopform.jax.ending(joint.Robot(k=0.0), horizon=20.0)
    x = {"J": 0.031, "b": 0.0085, "F_p": 0.042, "q_dot": 11.5}
    by = jax.jit(jax.jacrev(lambda x: (end(x).duration, end(x).end.q)))(x)
    with mp.workdps(40):
        for number in (0, 1):
            for name in x:
                at = {key: mp.mpf(value) for key, value in x.items()}
                exact = mp.diff(lambda value, name=name, at=at, n=number: spin_down({**at, name: value})[n], at[name])
                assert float(by[number][name]) == pytest.approx(float(exact), rel=2e-15), (number, name)


NAMES = {"J": "m", "b": "b", "k": "k", "F_p": "F_plus", "F_m": "F_minus", "k_t": "gamma", "q": "q", "q_dot": "v"}
"""What the oracle calls the inputs of the joint."""
STEP_TIMES = np.arange(8) * 0.125
TIMES = np.array([0.1875, 0.4375, 0.6875, 0.9375])


def drawn(seed: int) -> tuple[dict[str, float], np.ndarray]:
    """A joint, its start and steps of its current, in numbers that have few digits."""
    rng = np.random.default_rng([59, seed])
    low = {"J": 0.02, "b": 0.05, "k": 0.0, "F_p": 0.1, "F_m": 0.1, "k_t": 0.5, "q": -1.0, "q_dot": -4.0}
    high = {"J": 0.05, "b": 0.2, "k": 4.0, "F_p": 0.4, "F_m": 0.4, "k_t": 1.0, "q": 1.0, "q_dot": 4.0}
    x = {name: round(float(rng.uniform(low[name], high[name])), 3) for name in low}
    return x, np.round(rng.uniform(-1.5, 1.5, STEP_TIMES.size), 3)


def of_oracle(x: dict[str, Any], u: Any) -> list[Any]:
    """Angles and velocities at TIMES, by the oracle, of numbers of mpmath."""
    digits = {NAMES[name]: mp.nstr(mp.mpf(value), 60) for name, value in x.items()}
    steps = [[mp.nstr(mp.mpf(t), 60), mp.nstr(mp.mpf(value), 60)] for t, value in zip(STEP_TIMES, u, strict=True)]
    solved = mechanism.solve(builders.joint(**digits, u=steps, horizon="1"))
    states = [solved.at(mp.mpf(t)) for t in TIMES]
    return [state["q"] for state in states] + [state["v"] for state in states]


@night
@pytest.mark.parametrize("seed", range(4))
def test_derivatives_of_states_under_steps_are_those_of_sixty_digits(jax, joint, seed):
    """By start, parameters and each step, forwards and backwards; errors in units of a row's largest derivative by a
    relative change of an input. Central differences of a step of 1e-20 are good to 30 digits.
    """
    x, u = drawn(seed)
    course = hopform.jax.states(joint.Robot(k=0.0), TIMES, u_times=STEP_TIMES)
    given = {**x, "u": u}
    forwards, backwards = jax.jacfwd(course)(given), jax.jacrev(course)(given)
    assert any(event.kind in ("q_sticks", "q_reverses") for event in joint.solve_motion(
        joint.Robot(**{name: x[name] for name in x if not name.startswith("q")}), start={"q": x["q"], "q_dot": x["q_dot"]},
        u=[*zip(STEP_TIMES.tolist(), u.tolist(), strict=True)], horizon=1.0).events)  # fmt: skip
    columns: dict[Any, Any] = {}
    with mp.workdps(70):
        h = mp.mpf("1e-20")
        for name in (*x, *range(u.size)):
            sides = []
            for sign in (1, -1):
                moved = {key: mp.mpf(value) + sign * h * (key == name) for key, value in x.items()}
                sides.append(of_oracle(moved, [mp.mpf(value) + sign * h * (n == name) for n, value in enumerate(u)]))
            columns[name] = np.array([float((up - down) / (2 * h)) for up, down in zip(*sides, strict=True)])
    sizes = np.array([max(abs(each), 0.1) for each in (*x.values(), *u)])
    theirs = np.stack([*columns.values()], -1) * sizes
    for of in (forwards, backwards):
        ours = [np.concatenate([of.q[name], of.q_dot[name]]) for name in x]
        steps = np.concatenate([of.q["u"], of.q_dot["u"]])
        error = (np.column_stack([*ours, steps]) * sizes - theirs) / np.abs(theirs).max(-1, keepdims=True)
        assert np.abs(error).max() < 1e-12


def leaves(jax: Any, tree: Any) -> list[np.ndarray]:
    return [np.asarray(each) for each in jax.tree_util.tree_leaves(tree)]


def assert_same(jax: Any, ours: Any, theirs: Any) -> None:
    """To the bit."""
    pairs = zip(leaves(jax, ours), leaves(jax, theirs), strict=True)
    for one, other in pairs:
        np.testing.assert_array_equal(one, other)


@night
def test_transformations_agree_with_each_other_to_the_bit(jax, joint):
    """jit, vmap, vmap of vmap, forwards and backwards, a jvp along an input."""
    x, u = drawn(0)
    given = {"F_p": x["F_p"], "q_dot": x["q_dot"], "u": u}
    functions = (
        hopform.jax.states(joint.Robot(k=1.5), TIMES, u_times=STEP_TIMES),
        hopform.jax.ending(joint.Robot(k=1.5), u_times=STEP_TIMES, horizon=1.0),
    )
    for function in functions:
        by = jax.jacfwd(function)(given)
        assert_same(jax, jax.jit(function)(given), function(given))
        assert_same(jax, jax.jacrev(function)(given), by)
        assert_same(jax, jax.jit(jax.jacfwd(function))(given), by)
        along = {"F_p": 0.0, "q_dot": 1.0, "u": np.zeros(u.size)}
        assert_same(jax, jax.jvp(function, (given,), (along,))[1], jax.tree_util.tree_map(
            lambda each: each["q_dot"], by, is_leaf=lambda each: isinstance(each, dict)))  # fmt: skip
        many = {"F_p": np.linspace(0.1, 0.3, 5), "q_dot": np.linspace(-3.0, 3.0, 5), "u": np.outer(np.arange(5.0), u)}
        alone = [jax.jacrev(function)({name: values[n] for name, values in many.items()}) for n in range(5)]
        stacked = jax.tree_util.tree_map(lambda *each: np.stack(each), *alone)
        assert_same(jax, jax.jit(jax.vmap(jax.jacrev(function)))(many), stacked)
        columns = jax.vmap(lambda u, of=function: of({"u": u}), in_axes=1)(many["u"].T)
        assert_same(jax, columns, jax.vmap(lambda u, of=function: of({"u": u}))(many["u"]))
        of_both = jax.vmap(jax.vmap(lambda F, u, of=function: of({"F_p": F, "u": u}), (None, 0)), (0, None))
        pairs = [[function({"F_p": F, "u": steps}) for steps in many["u"]] for F in many["F_p"]]
        rows = [jax.tree_util.tree_map(lambda *each: np.stack(each), *row) for row in pairs]
        assert_same(jax, jax.jit(of_both)(many["F_p"], many["u"]), jax.tree_util.tree_map(
            lambda *each: np.stack(each), *rows))  # fmt: skip


@night
def test_a_batch_is_one_call_with_the_columns_that_are_asked_for(jax, joint):
    asked: list[Any] = []

    def counted(*given: Any, **settings: Any) -> Any:
        asked.append(settings["sensitivities"])
        return hopform.solve_motions(*given, **settings)

    end = hopform.jax.ending(joint.Robot(k=0.0), u_times=[0.0, 0.1], horizon=1.0)
    many = {"b": np.linspace(0.01, 0.02, 7), "F_p": np.full(7, 0.04), "u": np.ones((7, 2))}
    with patch.object(hopform.jax, "solve_motions", counted):
        jax.vmap(end)(many)
        jax.vmap(jax.grad(lambda x: end(x).end.q))(many)
        jax.vmap(jax.grad(lambda b: end({"b": b, "F_p": 0.04}).end.q))(many["b"])
        jax.grad(lambda u: end({"b": 0.01, "u": u}).end.q)(np.ones(2))
        jax.jvp(lambda F: end({"b": 0.01, "F_p": F}).duration, (0.04,), (1.0,))
    assert asked == [False, ["F_p", "b", "u[0]", "u[1]"], ["b"], ["u[0]", "u[1]"], ["F_p"]]


@night
def test_times_of_steps_are_inputs_too(jax, joint):
    """By central differences; the first is 0 and moves nothing. Batches that share them are one call, others agree."""
    x, u = drawn(1)
    course = hopform.jax.states(joint.Robot(k=1.5), TIMES, u=u, u_times=STEP_TIMES)
    by = jax.jacrev(lambda t, F: course({"u_times": t, "F_p": F}), argnums=(0, 1))(STEP_TIMES, x["F_p"])
    h = 1e-6
    for n in range(1, u.size):
        sides = [
            course({"u_times": STEP_TIMES + sign * h * (np.arange(u.size) == n), "F_p": x["F_p"]}) for sign in (1, -1)
        ]
        theirs = (sides[0].q - sides[1].q) / (2 * h)
        np.testing.assert_allclose(by.q[0][:, n], theirs, rtol=0.0, atol=1e-8)
    assert not np.any(by.q[0][:, 0]) and np.count_nonzero(by.q[0][-1]) > 4
    only = jax.jacfwd(lambda t: course({"u_times": t, "F_p": x["F_p"]}))(STEP_TIMES)
    assert_same(jax, only.q, by.q[0])
    many = np.stack([STEP_TIMES, 0.9 * STEP_TIMES, STEP_TIMES])
    other = [jax.jacrev(lambda t: course({"u_times": t}))(each) for each in many]
    stacked = jax.tree_util.tree_map(lambda *each: np.stack(each), *other)
    assert_same(jax, jax.jit(jax.vmap(jax.jacrev(lambda t: course({"u_times": t}))))(many), stacked)
    with pytest.raises(hopform.HopformError, match="u_times\\[2\\] must be > the one before"):
        course({"u_times": STEP_TIMES[[0, 2, 1, 3, 4, 5, 6, 7]]})


@night
def test_threads_change_nothing(jax, joint):
    """Those of a batch, and those of Python that call the same function."""
    x = {"b": np.linspace(0.004, 0.012, 12_000), "F_p": np.linspace(0.03, 0.05, 12_000)}
    one, four = (
        jax.jit(jax.vmap(jax.grad(lambda x, end=end: end(x).end.q)))
        for end in (
            hopform.jax.ending(joint.Robot(k=0.0), start={"q_dot": 11.5}, horizon=20.0, threads=threads)
            for threads in (1, 4)
        )
    )
    expected = one(x)
    assert_same(jax, four(x), expected)
    with ThreadPoolExecutor(6) as pool:
        for answer in pool.map(lambda _: one(x), range(12)):
            assert_same(jax, answer, expected)


ONE_CORE = """
import os
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
import hopform.jax, jax, numpy as np
assert "jax" in __import__("sys").modules
jax.config.update("jax_enable_x64", True)
end = hopform.jax.ending(hopform.load_solver("joint").Robot(k=0.0), start={"q_dot": 11.5}, horizon=20.0)
slopes = jax.jit(jax.vmap(jax.grad(lambda b: end({"b": b}).end.q)))(np.linspace(0.004, 0.012, 50_000))
print(np.isfinite(slopes).all())
"""


@night
@pytest.mark.skipif(
    not hasattr(__import__("os"), "sched_setaffinity"), reason="a process cannot be kept on one core here"
)
def test_on_one_core_a_compiled_batch_waits_for_nobody(jax, joint):
    """JAX's own callbacks wait there for values that the thread brings which they block."""
    done = subprocess.run([sys.executable, "-c", ONE_CORE], capture_output=True, text=True, check=True, timeout=300)
    assert done.stdout == "True\n"


@night
def test_jax_is_loaded_by_nobody_who_does_not_use_it():
    program = "import hopform, hopform.jax, sys; hopform.load_robot('hopper_c'); assert 'jax' not in sys.modules"
    subprocess.run([sys.executable, "-c", program], check=True)


# ---- a hopper ----


@night
def test_the_apex_of_a_hop_has_the_derivatives_of_its_stance(jax):
    hop = hopform.jax.ending(HOPPER, start={"v2": -1.93})
    by = jax.grad(lambda x: hop(x).apex)({"u": 2.0, "k": 1200.0})
    stance = hopform.solve_stance(dataclasses.replace(HOPPER, k=1200.0), v2=-1.93, u=2.0)
    assert {name: float(each) for name, each in by.items()} == {
        name: stance.sensitivities["apex", name] for name in ("u", "k")
    }
    assert float(hop({"u": 2.0, "k": 1200.0}).aed) == stance.aed
    by_load = jax.grad(lambda y: hopform.jax.ending(HOPPER)({"y": y, "u": 3.0}).apex)(0.02)
    difference = [hopform.solve_motion(HOPPER, start={"y": 0.02 + h}, u=3.0).apex for h in (1e-6, -1e-6)]
    assert float(by_load) == pytest.approx((difference[0] - difference[1]) / 2e-6, rel=1e-6)


@night
def test_a_loss_that_puts_something_in_the_place_of_what_is_nan_has_the_gradient_of_the_rest(jax):
    """States behind a take-off, and an apex without one; what is not replaced shows itself."""
    t = np.linspace(0.0, 0.3, 31)
    seen = t < hopform.solve_stance(HOPPER, v2=-1.93, u=2.0).duration
    both, alone = (hopform.jax.states(HOPPER, of, start={"v2": -1.93}) for of in (t, t[seen]))

    def loss(u: Any, of: Any = both) -> Any:
        x2 = of({"u": u}).x2
        return (jax.numpy.where(jax.numpy.isnan(x2), 0.0, x2) ** 2).sum()

    assert 10 < seen.sum() < 25 and np.isnan(both({"u": 2.0}).x2[~seen]).all()
    assert float(jax.grad(loss)(2.0)) == pytest.approx(float(jax.grad(lambda u: loss(u, alone))(2.0)), rel=1e-14)
    assert np.isnan(jax.grad(lambda u: (both({"u": u}).x2 ** 2).sum())(2.0))
    stand = hopform.jax.ending(HOPPER, start={"v2": -0.5}, u=1.0)
    assert np.isnan(stand({}).apex)
    by = jax.jacrev(stand)({"k": 1200.0})
    assert (
        float(by.apex["k"]) == 0.0
        and float(by.end.x2["k"]) == float(jax.jacfwd(stand)({"k": 1200.0}).end.x2["k"]) != 0.0
    )


# ---- where there are no derivatives ----

BALANCED = {"m_eff": 32.0, "m_s": 4.0, "f1": 2.0, "f2": 3.0, "b1": 0.0, "g": 0.0, "gamma2": -64.0}
"""At 1 A the actuator is held at the level of its friction exactly."""


def balanced(**changes: float) -> hopform.Robot:
    free = {"x1_min": float("-inf"), "x1_max": float("inf")}
    return dataclasses.replace(HOPPER, **{**free, **BALANCED, **changes})


@night
def test_at_a_rest_that_a_small_change_ends_there_is_nan_or_on_request_what_holds_to_one_side(jax):
    many = np.array([0.5, 1.0])
    for grazing, expected in (("nan", np.nan), ("one-sided", 0.0)):
        course = hopform.jax.states(balanced(), [0.0, 0.1], start={"v2": 0.0}, grazing=grazing)
        end = hopform.jax.ending(balanced(), start={"v2": 0.0}, grazing=grazing)
        with pytest.warns(RuntimeWarning, match="derivatives do not exist in 1 of 2 motions"):
            by = jax.vmap(jax.jacrev(lambda u, of=course: of({"u": u})))(many)
        np.testing.assert_array_equal(by.x1, [[0.0, 0.0], [expected, expected]])
        with pytest.warns(RuntimeWarning, match="derivatives do not exist in 1 of 2 motions"):
            by = jax.vmap(jax.jacfwd(lambda u, of=end: of({"u": u})))(many)
        np.testing.assert_array_equal(by.end.x1, [0.0, expected])
        np.testing.assert_array_equal(by.duration, [0.0, np.nan])
    free = hopform.jax.states(balanced(f1=0.0, f2=0.0), [0.1], start={"v2": 0.0}, grazing="one-sided")
    with pytest.warns(RuntimeWarning, match="NaN, or at a rest those to one side"):
        assert np.isnan(jax.grad(lambda u: free({"u": u}).x1[0])(0.0))  # any change sets it moving


def test_derivatives_are_known_up_to_the_event_that_grazes():
    """Found among the events of a motion, of which one that ends between two events has derivatives or not."""
    motion = hopform.solve_stance(HOPPER, v2=-1.93, u=0.75)
    times = [event.time for event in motion.events]
    assert len(times) >= 3
    for number, graze in enumerate([*times, math.inf]):
        asked: list[float] = []

        def solve(horizon: float, graze: float = graze, asked: list[float] = asked) -> Any:
            asked.append(horizon)
            matrix = np.full((1, 1), np.nan if horizon > graze else 0.0)
            return SimpleNamespace(sensitivities=SimpleNamespace(matrix=matrix))

        for one_sided in (False, True):
            assert known_until(solve, motion, one_sided) == graze, number
        assert len(asked) <= 2 * len(times) and not set(asked) & {0.0, *times}


@night
def test_where_a_search_has_ended_there_are_none_at_the_ending(jax):
    hop = hopform.jax.ending(HOPPER, start={"v2": -1.93}, max_phases=1, grazing="one-sided")
    with pytest.warns(RuntimeWarning, match="derivatives do not exist in 1 of 1 motions"):
        assert np.isnan(jax.grad(lambda u: hop({"u": u}).end.x2)(2.0))


@night
def test_a_stop_that_is_touched_is_no_event_and_one_that_is_hit_is_one(jax, joint):
    """A swing that just reaches its stop has the derivative of one that misses it; one that hits it ends there."""
    swing = {"J": 1.0, "k": 1.0, "b": 0.0, "F_p": 0.0, "F_m": 0.0}
    by = [
        jax.jacrev(hopform.jax.states(joint.Robot(**swing, q_min=stop), [3.3]))({"q": 1.0}).q["q"][0]
        for stop in (-math.inf, -1.0, -0.9)
    ]
    assert float(by[0]) == float(by[1]) == pytest.approx(math.cos(3.3), rel=1e-14) and float(by[2]) != float(by[0])


@night
def test_second_derivatives_are_refused(jax, joint):
    end = hopform.jax.ending(joint.Robot(k=0.0), start={"q_dot": 11.5}, horizon=20.0)
    course = hopform.jax.states(joint.Robot(k=0.0), [0.1], start={"q_dot": 11.5})
    for twice in (
        lambda: jax.hessian(lambda b: end({"b": b}).end.q)(0.0085),
        lambda: jax.jit(jax.grad(jax.grad(lambda b: end({"b": b}).end.q)))(0.0085),
        lambda: jax.jacfwd(jax.jacfwd(lambda b: course({"b": b}).q))(0.0085),
        lambda: jax.jvp(lambda F: jax.grad(lambda b: end({"b": b, "F_p": F}).end.q)(0.0085), (0.04,), (1.0,)),
    ):
        with pytest.raises(hopform.HopformError, match="has first derivatives alone"):
            twice()


# ---- what goes in ----


@night
def test_names_and_shapes_are_checked_when_a_function_is_called_or_traced(jax, joint):
    end = hopform.jax.ending(joint.Robot(), u_times=[0.0, 0.1, 0.2])
    many = "; vmap maps it over many; got shape"
    for x, message in (
        ({"mass": 1.0}, "'mass' is neither an input of a motion nor a field of the robot"),
        ({"F_P": 1.0}, "did you mean 'F_p'?"),
        ({"b": np.ones(3)}, f"b must be a number{many} (3,)"),
        ({"u": 1.0}, f"u must be an array of shape (3,), a number for each of u_times{many} ()"),
        ({"u": np.ones(3), "i": np.ones(3)}, "give the input once, got it as i and as u"),
        ({0: 1.0}, "0"),
        ([1.0], "x must be a mapping of names to values, got ["),
    ):
        for call in (end, jax.jit(end)):
            with pytest.raises((hopform.HopformError, TypeError), match=re.escape(message)):
                call(x)
    assert_same(jax, end({"i": np.ones(3)}), end({"u": np.ones(3)}))


@night
def test_a_value_out_of_range_says_so_within_jit_too(jax, joint):
    end = hopform.jax.ending(joint.Robot())
    with pytest.raises(hopform.HopformError, match="J must be > 0 kg m\\^2, got -1.0"):
        end({"J": -1.0})
    with pytest.raises(Exception, match="HopformError: J\\[1\\] must be > 0 kg m\\^2, got -1.0"):
        jax.jit(jax.vmap(lambda J: end({"J": J}).end.q))(np.array([1.0, -1.0])).block_until_ready()


@night
def test_precision_is_said_and_not_lost_in_silence(jax, joint):
    single = hopform.jax.ending(joint.Robot(k=0.0), start={"q_dot": 11.5}, horizon=20.0, dtype="float32")
    double = hopform.jax.ending(joint.Robot(k=0.0), start={"q_dot": 11.5}, horizon=20.0)
    by = float(jax.grad(lambda b: double({"b": b}).end.q)(0.0085))
    assert double({}).end.q.dtype == np.float64 and single({}).end.q.dtype == np.float32
    jax.config.update("jax_enable_x64", False)
    try:
        for call in (double, jax.jit(double), jax.grad(lambda x: double(x).end.q)):
            with pytest.raises(hopform.HopformError, match="float64 needs jax.config.update"):
                call({"b": 0.0085})
        slope = jax.jit(jax.grad(lambda b: single({"b": b}).end.q))(0.0085)
        assert slope.dtype == np.float32 and float(slope) == pytest.approx(by, rel=1e-5)
    finally:
        jax.config.update("jax_enable_x64", True)


# ---- pages ----


@night
def test_the_examples_of_the_module_run(jax):
    outcome = doctest.testmod(hopform.jax)
    assert outcome.attempted > 8 and outcome.failed == 0


@night
def test_a_joint_is_identified_where_smoothed_friction_fails_as_its_page_says(jax, capsys):
    """The programs of the page as they stand there, and each row of its table."""
    page = PAGE.read_text("utf-8")
    space: dict[str, Any] = {}
    for program in re.findall(r"^```python\n((?!>>> ).*?)^```", page, re.DOTALL | re.MULTILINE):
        exec(program, space)  # noqa: S102
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("| ")]
    errors = [
        [abs(float(cell)) for cell in row.split(" | ")[2:4]] + [abs(float(row.split(" | ")[4][:-2]))] for row in rows
    ]
    assert len(rows) == 4 and [row for row in rows if row not in page] == []
    assert all(error < 1.0 for row in errors[:2] for error in row)
    assert all(row[2] > 10.0 for row in errors[2:])  # b
