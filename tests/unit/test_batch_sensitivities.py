"""Derivatives of many stances: those of each stance alone, for whatever broadcasts."""

import numpy as np
import pytest

import hopform
from hopform._sensitivities import COLUMNS

SIDES = {"v2": np.linspace(-2.8, -0.3, 5)[:, np.newaxis], "u": np.linspace(-3.0, 3.0, 7)}


def scaled(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Largest difference, each row over its largest entry; the same NaN in both."""
    np.testing.assert_array_equal(np.isnan(ours), np.isnan(theirs))
    size = np.nanmax(np.abs(theirs), axis=-1, keepdims=True, initial=0.0)
    return float(np.nanmax(np.abs(ours - theirs) / np.where(size > 0.0, size, 1.0), initial=0.0))


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("x2", [None, 0.38])
def test_the_library_gives_each_stance_its_own_derivatives_to_the_bit(hopper_c, dtype, x2):
    batch = hopform.solve_stances(hopper_c, x2=x2, sensitivities=True, dtype=dtype, **SIDES)
    assert batch.sensitivities is not None
    assert batch.sensitivities.matrix.shape == (5, 7, 7, 22)
    assert batch.sensitivities.matrix.dtype == dtype
    lifted = 0
    for (i, j), apex in np.ndenumerate(batch.apex):
        v2, u = float(SIDES["v2"][i, 0]), float(SIDES["u"][j])
        alone = hopform.solve_stance(hopper_c, v2=v2, u=u, x2=x2, dtype=dtype)
        np.testing.assert_array_equal(batch.sensitivities.matrix[i, j], alone.sensitivities.matrix)
        np.testing.assert_equal(float(batch.sensitivities["apex", "k"][i, j]), alone.sensitivities["apex", "k"])
        lifted += not np.isnan(apex)
    assert lifted > 20


def test_they_are_left_out_unless_asked_for(hopper_c):
    assert hopform.solve_stances(hopper_c, v2=-1.93).sensitivities is None


def test_a_number_of_each_input_gives_one_matrix(hopper_c):
    batch = hopform.solve_stances(hopper_c, v2=-1.93, u=3.0, sensitivities=True)
    alone = hopform.solve_stance(hopper_c, v2=-1.93, u=3.0).sensitivities
    assert batch.sensitivities is not None
    np.testing.assert_array_equal(batch.sensitivities.matrix, alone.matrix)
    assert batch.sensitivities["apex", "u"].shape == ()


def test_no_stance_has_no_derivatives(hopper_c):
    batch = hopform.solve_stances(hopper_c, v2=np.zeros(0), sensitivities=True)
    assert batch.sensitivities is not None
    assert batch.sensitivities.matrix.shape == (0, 7, 22)


def test_a_stance_without_answer_has_none(hopper_c):
    """The second comes to rest, and has no apex, the third leaves the range of the type; their neighbours keep theirs."""
    batch = hopform.solve_stances(
        hopper_c, v2=[-1.93, -0.01, -1e200, -1.93], u=[3.0, 1.0, 3.0, 3.0], f2=[0.6, 30.0, 0.6, 0.6],
        sensitivities=True,
    )  # fmt: skip
    assert batch.words[[0, 3]].tolist() == ["takeoff", "takeoff"]
    assert batch.words[1] == "rest"
    assert batch.sensitivities is not None
    missing = np.isnan(batch.sensitivities.matrix).all(axis=2)
    assert missing.all(axis=1).tolist() == [False, False, True, False]
    assert missing[1].tolist() == [name == "apex" for name in batch.sensitivities.rows]
    np.testing.assert_array_equal(batch.sensitivities.matrix[0], batch.sensitivities.matrix[3])


def test_without_gravity_only_the_apex_has_none(hopper_c):
    batch = hopform.solve_stances(hopper_c, v2=-1.93, u=3.0, g=[9.81, 0.0], sensitivities=True)
    assert batch.sensitivities is not None
    rows = np.isnan(batch.sensitivities.matrix).any(axis=2)
    assert rows[0].tolist() == [False] * 7
    assert rows[1].tolist() == [name == "apex" for name in batch.sensitivities.rows]


def test_chains_longer_than_the_room_for_them_are_taken_again(hopper_c, monkeypatch):
    whole = hopform.solve_stances(hopper_c, sensitivities=True, **SIDES)
    phases = whole.event_count[~np.isnan(whole.apex)] + 1
    assert (phases == 1).sum() < (phases > 1).sum()
    monkeypatch.setattr("hopform._solver.c.FIRST_CAPACITY", 1)
    again = hopform.solve_stances(hopper_c, sensitivities=True, **SIDES)
    assert whole.sensitivities is not None
    assert again.sensitivities is not None
    np.testing.assert_array_equal(again.sensitivities.matrix, whole.sensitivities.matrix)
    capped = hopform.solve_stances(hopper_c, sensitivities=True, max_phases=1, **SIDES)
    assert capped.sensitivities is not None
    np.testing.assert_array_equal(np.isnan(capped.sensitivities["T", "k"]), capped.status != 1)


def test_chunks_threads_and_layouts_change_nothing(hopper_c):
    u = np.linspace(-3.0, 3.0, 10_000)
    v2 = np.linspace(-2.5, -0.5, 20_000)[::2]
    whole = hopform.solve_stances(hopper_c, v2=v2, u=u, sensitivities=True)
    spread = hopform.solve_stances(
        hopper_c, v2=v2.reshape(100, 100), u=u.reshape(100, 100), sensitivities=True, threads=3
    )  # fmt: skip
    assert whole.sensitivities is not None
    assert spread.sensitivities is not None
    np.testing.assert_array_equal(spread.sensitivities.matrix.reshape(-1, 7, 22), whole.sensitivities.matrix)


def test_a_name_that_is_none_is_refused(hopper_c):
    batch = hopform.solve_stances(hopper_c, v2=-1.93, sensitivities=True)
    assert batch.sensitivities is not None
    with pytest.raises(hopform.HopformError, match="there is no sensitivity 'apex', 'mass': 'mass' is not one of x1, "):
        _ = batch.sensitivities["apex", "mass"]
    with pytest.raises(hopform.HopformError, match="'height' is not one of T, x1"):
        _ = batch.sensitivities["height", "k"]
    assert batch.sensitivities.columns == COLUMNS
    with pytest.raises(ValueError, match="read-only"):
        batch.sensitivities.matrix[...] = 0.0
