"""A stance as people hold it: frozen, equal, copied, pickled, shared by threads; its fields unfold when asked for."""

import copy
import dataclasses
import pickle
import signal
import subprocess
import sys
import threading
from typing import Any

import numpy as np
import pytest

import hopform
from hopform._solver import c as native

FIELDS = [field.name for field in dataclasses.fields(hopform.Stance)]
LATER = ["events", "phases", "warnings"]
SHOWN = [name for name in FIELDS if not name.startswith("_")] + LATER
STEPS = [(0.0, 0.5), (0.05, 2.5), (0.11, -1.0)]


def values(stance: hopform.Stance) -> dict[str, Any]:
    return {name: getattr(stance, name) for name in SHOWN}


@pytest.fixture(params=[np.float64, np.float32])
def stance(hopper_c, request) -> hopform.Stance:
    return hopform.solve_stance(hopper_c, v2=-1.93, u=STEPS, dtype=request.param)


def test_every_field_of_a_stance_is_there_without_being_asked_for_before(hopper_c, stance):
    unasked = hopform.solve_stance(hopper_c, v2=-1.93, u=STEPS, dtype=stance.dtype)
    assert vars(unasked).keys() == set(FIELDS)
    for name in FIELDS + LATER:
        fresh = copy.copy(stance)
        assert getattr(fresh, name) == getattr(stance, name) or name == "_solved", name


def test_a_field_that_a_stance_does_not_have_is_no_field(stance):
    with pytest.raises(AttributeError, match="'Stance' object has no attribute 'apexx'"):
        _ = stance.apexx
    for name in ("apex", "events"):
        assert not hasattr(object.__new__(hopform.Stance), name)


@pytest.mark.parametrize("asked", [False, True])
def test_a_stance_stays_as_it_is(stance, asked):
    fresh = copy.copy(stance)
    if asked:
        _ = fresh.apex
    for name in ("apex", "robot", "_solved", "anything"):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(fresh, name, 0.0)
        with pytest.raises(dataclasses.FrozenInstanceError):
            delattr(fresh, name)


def test_stances_are_equal_that_have_equal_fields(hopper_c, stance):
    def again(**changes: Any) -> hopform.Stance:
        start = {"v2": -1.93, "u": STEPS, "dtype": stance.dtype}
        return hopform.solve_stance(hopper_c, **{**start, **changes})

    assert again() == stance
    assert hash(again()) == hash(stance)
    assert repr(again()) == repr(stance)
    assert again(v2=-1.94) != stance
    assert again(u=[*STEPS[:2], (0.12, -1.0)]) != stance
    changed = dataclasses.replace(stance, apex=1.0)
    assert changed.apex == 1.0
    assert changed != stance
    assert changed.events == stance.events


@pytest.mark.parametrize("asked", [False, True])
@pytest.mark.parametrize(
    "another",
    [copy.copy, copy.deepcopy, *(lambda stance, n=n: pickle.loads(pickle.dumps(stance, n)) for n in range(6))],
)
def test_a_copy_of_a_stance_is_the_stance(stance, asked, another):
    fresh = copy.copy(stance)
    if asked:
        _ = fresh.apex, fresh.phases
    other = another(fresh)
    assert values(other) == values(stance)
    assert other == stance
    t = np.linspace(0.0, stance.duration, 9)
    for ours, theirs in zip(other.at(t), stance.at(t), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(other.sensitivities.matrix, stance.sensitivities.matrix)
    assert other.ledger(t[4]) == stance.ledger(t[4])


def test_a_stance_goes_to_another_process(hopper_c, tmp_path):
    stance = hopform.solve_stance(hopper_c, v2=-1.93, u=STEPS)
    (tmp_path / "stance.pickle").write_bytes(pickle.dumps(stance))
    code = (
        "import pickle, sys\n"
        "stance = pickle.load(open(sys.argv[1], 'rb'))\n"
        "print(repr((stance.apex, stance.events, stance.at(0.05))))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "stance.pickle")], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == repr((stance.apex, stance.events, stance.at(0.05)))


def test_a_stance_of_another_library_is_refused(hopper_c, monkeypatch):
    stance = hopform.solve_stance(hopper_c, v2=-1.93)
    pickled = pickle.dumps(stance)
    source = native.library().source
    assert pickled.count(source.encode()) == 1
    with pytest.raises(hopform.BackendError, match="the stance was solved by a library built from "):
        pickle.loads(pickled.replace(source.encode(), source[::-1].encode()))


def test_a_robot_is_what_it_was_after_it_was_used(hopper_c):
    used, fresh = hopform.load_robot("hopper_c"), hopform.load_robot("hopper_c")
    hopform.solve_stance(used, v2=-1.93)
    assert used == fresh
    assert (hash(used), repr(used), dataclasses.asdict(used)) == (hash(fresh), repr(fresh), dataclasses.asdict(fresh))
    assert pickle.loads(pickle.dumps(used)) == copy.deepcopy(used) == fresh
    stiffer = dataclasses.replace(used, k=2000.0)
    assert stiffer.parameters.k == 2000.0
    assert hopform.solve_stance(stiffer, v2=-1.93).duration < hopform.solve_stance(used, v2=-1.93).duration
    with pytest.raises(dataclasses.FrozenInstanceError):
        used.parameters = stiffer.parameters  # type: ignore[misc]


def test_threads_solve_and_unfold_the_same_stances_side_by_side(hopper_c):
    velocities = np.linspace(-3.0, -0.5, 40).tolist()
    expected = [values(hopform.solve_stance(hopper_c, v2=v2, u=2.0)) for v2 in velocities]
    shared = [hopform.solve_stance(hopper_c, v2=v2, u=2.0) for v2 in velocities]
    wrong: list[object] = []

    def work() -> None:
        for _ in range(10):
            for n, v2 in enumerate(velocities):
                if values(hopform.solve_stance(hopper_c, v2=v2, u=2.0)) != expected[n]:
                    wrong.append(v2)
                if values(shared[n]) != expected[n]:
                    wrong.append(shared[n])

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        threads = [threading.Thread(target=work) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert not wrong


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="there is no timer signal here")
def test_a_signal_handler_may_solve_while_a_stance_is_solved(hopper_c):
    calls: list[float] = []
    expected = values(hopform.solve_stance(hopper_c, v2=-1.93, u=2.0))

    def handler(*_: object) -> None:
        calls.append(hopform.solve_stance(hopper_c, v2=-0.7, u=-1.0).duration)

    before = signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, 1e-4, 1e-4)
    try:
        while len(calls) < 200:
            assert values(hopform.solve_stance(hopper_c, v2=-1.93, u=2.0)) == expected
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert len(set(calls)) == 1


def test_a_stance_of_more_phases_than_there_was_room_for_has_them_all(hopper_c):
    sunk = dataclasses.replace(hopper_c, k=30.0, b1=0.0, b2=0.0, f1=0.0, f2=0.0, g=500.0, x1_min=0.0, x1_max=0.0)
    many = hopform.solve_stance(sunk, v2=-0.1, x2=-15.0, horizon=200.0)
    assert len(many.phases) == len(many.events) + 1 > 64
    assert [phase.end for phase in many.phases[:-1]] == [phase.start for phase in many.phases[1:]]
    capped = hopform.solve_stance(sunk, v2=-0.1, x2=-15.0, horizon=200.0, max_phases=70)
    assert capped.status == "too_many_phases"
    assert capped.phases[:69] == many.phases[:69]


# ---- evaluation ----


def test_one_time_and_many_times_give_the_same(stance):
    t = np.linspace(0.0, stance.duration, 101)
    t[-1] = stance.duration
    states, energies, ledgers = stance.at(t), stance.energy(t), stance.ledger(t)
    for n in (0, 1, 37, 100):
        one = float(t[n])
        assert all(isinstance(value, float) for value in (*stance.at(one), *stance.energy(one), *stance.ledger(one)))
        assert stance.at(one) == tuple(float(column[n]) for column in states)
        assert stance.energy(one) == tuple(float(column[n]) for column in energies)
        assert stance.ledger(one) == tuple(float(column[n]) for column in ledgers)


def test_times_of_any_layout_give_the_same(stance):
    t = np.linspace(0.0, stance.duration, 24, dtype=stance.dtype)
    t[-1] = stance.duration
    for view in (t[::-2], t.reshape(4, 6).T, np.broadcast_to(t[3], (2, 3)), t[:0]):
        for ours, theirs in zip(stance.at(view), stance.at(np.array(view)), strict=True):
            assert np.shape(ours) == view.shape
            np.testing.assert_array_equal(ours, theirs)
        for ours, theirs in zip(stance.energy(view), stance.energy(np.array(view)), strict=True):
            np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("t", [-1e-9, 1.0, float("nan"), float("inf"), [0.0, 1.0]])
@pytest.mark.parametrize("of", ["at", "energy", "ledger", "compression"])
def test_a_time_outside_is_refused_by_name(stance, of, t):
    with pytest.raises(hopform.HopformError, match=r"^t must be 0 <= t <= 0\.\d+ s, got "):
        getattr(stance, of)(t)


def test_after_rest_any_finite_time_will_do(hopper_c):
    robot = dataclasses.replace(hopper_c, f1=5.0, f2=5.0)
    stance = hopform.solve_stance(robot, v2=-0.1, horizon=60.0)
    assert stance.status == "rest"
    assert stance.at(1e6) == stance.at(stance.duration) == stance.end
    assert stance.energy(1e6) == stance.energy(stance.duration)
    with pytest.raises(hopform.HopformError, match="^t must be 0 <= t, got inf$"):
        stance.at(float("inf"))


def test_times_may_be_what_nobody_may_write_to_or_lie_apart(stance):
    t = np.linspace(0.0, stance.duration, 7).astype(stance.dtype)
    fixed, apart, none = t.copy(), np.repeat(t, 3)[::3], t[:0]
    fixed.flags.writeable = False
    for other in (fixed, apart):
        assert np.array_equal(stance.at(other), stance.at(t))
        assert np.array_equal(stance.energy(other), stance.energy(t))
    assert stance.at(none).x1.shape == (0,)
