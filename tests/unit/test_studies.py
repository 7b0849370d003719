"""Sweeps and comparisons: labelled arrays in, a dataset with the same labels out, each number that of the one call."""

import numpy as np
import pytest
import xarray

import hopform
import hopform.hopping
from hopform import HopformError

HOPPER = hopform.load_robot("hopper_c")
U = np.array([0.0, 1.5, 3.0])


def test_a_sweep_has_an_axis_for_each_list_and_the_numbers_of_single_stances():
    found = hopform.sweep(HOPPER, height=[0.1, 0.2], u=U, k=[1100.0, 1300.0], f2=0.5)
    assert dict(found.sizes) == {"height": 2, "u": 3, "k": 2} and found.k.attrs == {"units": "N/m"}
    assert float(found.f2) == 0.5 and found.f2.attrs == {"units": "m/s^2"} and found.apex.attrs == {"units": "m"}
    from dataclasses import replace

    robot = replace(HOPPER, k=1300.0, f2=0.5)
    one = hopform.solve_stance(robot, v2=hopform.touchdown_velocity(robot, 0.2), u=1.5)
    here = found.sel(height=0.2, u=1.5, k=1300.0)
    assert (float(here.apex), float(here.duration), str(here.status.values)) == (one.apex, one.duration, one.status)


def test_a_drop_counts_the_gravity_and_the_loss_that_are_swept():
    found = hopform.sweep(HOPPER, height=[0.1, 0.2], impact_loss=[0.0, 0.3])
    fields = {"v2": -np.sqrt(2.0 * HOPPER.g * np.array([[0.1], [0.2]]) * (1.0 - np.array([0.0, 0.3])))}
    batch = hopform.solve_stances(HOPPER, **fields, impact_loss=[0.0, 0.3])
    np.testing.assert_array_equal(found.apex.transpose("height", "impact_loss"), batch.apex)


def test_labels_go_through_solve_stances_in_any_order():
    v2 = xarray.DataArray([-2.0, -1.0], dims="speed", coords={"speed": [-2.0, -1.0]})
    both = xarray.DataArray(np.outer(U, [1.0, 0.5]), dims=("amperes", "speed"))
    batch = hopform.solve_stances(HOPPER, v2=v2, u=both)
    assert batch.apex.shape == (2, 3) and batch.labels is not None and batch.labels.dims == ("speed", "amperes")
    found = batch.to_xarray()
    assert dict(found.sizes) == {"speed": 2, "amperes": 3} and found.speed.values.tolist() == [-2.0, -1.0]
    expected = hopform.solve_stances(HOPPER, v2=[[-2.0], [-1.0]], u=np.outer(U, [1.0, 0.5]).T)
    np.testing.assert_array_equal(found.apex, expected.apex)


@pytest.mark.parametrize(
    ("inputs", "said"),
    [
        ({"v2": -1.0, "height": 0.1}, "give either height or v2, got both"),
        ({"u": [1.0]}, "give either height or v2, got neither"),
        ({"height": [-0.1, 0.2]}, r"height\[0\] must be >= 0 m, got -0.1"),
        ({"v2": [[-1.0]]}, "v2 must be a number, a list of numbers or a DataArray, got shape"),
        ({"v2": [-1.0], "stiffness": 3.0}, "'stiffness' is neither an input of a stance nor a field"),
        ({"v2": [-1.0], "k": [0.0]}, r"k.* must be > 0"),
        ({"v2": [-1.0], "u": "three"}, "u must be"),
    ],
)
def test_what_cannot_be_swept_is_refused_by_name(inputs, said):
    with pytest.raises(HopformError, match=said):
        hopform.sweep(HOPPER, **inputs)


def test_labels_that_contradict_each_other_are_refused():
    v2 = xarray.DataArray([-2.0, -1.0], dims="a", coords={"a": [1.0, 2.0]})
    for other, said in (
        (
            xarray.DataArray([0.0, 1.0], dims="a", coords={"a": [1.0, 3.0]}),
            "u must have the coordinates a of the other",
        ),
        (np.array([0.0, 1.0]), "u must be a number or a DataArray beside other DataArrays"),
        (xarray.DataArray([0.0, 1.0, 2.0], dims="a"), "the shapes of the inputs must broadcast"),
    ):
        with pytest.raises(HopformError, match=said):
            hopform.solve_stances(HOPPER, v2=v2, u=other)


def test_a_comparison_has_the_runs_that_simulate_makes():
    laws = {
        "exact": hopform.hopping.controllers.FeedForward(0.2),
        "printed": hopform.hopping.controllers.AsPrinted(0.2),
        "3 A": 3.0,
    }
    grounds = {"even": [0.0] * 3, "rough": [0.0, 0.02]}
    noisy = {"none": hopform.hopping.Errors(), "noise": hopform.hopping.Errors(v2=0.05)}
    calls: list[tuple[int, int]] = []
    found = hopform.hopping.compare(
        HOPPER, laws, grounds, noisy, seeds=[3, 4], height=0.2, progress=lambda *done: calls.append(done)
    )
    assert dict(found.sizes) == {"controller": 3, "ground": 2, "errors": 2, "seed": 2, "hop": 3}
    assert calls == [(n, 24) for n in range(1, 25)]
    how = {"height": 0.2, "errors": noisy["noise"], "seed": 4, "cell": (1, 1)}
    run = hopform.hopping.simulate(HOPPER, grounds["rough"], laws["printed"], **how)
    here = found.sel(controller="printed", ground="rough", errors="noise", seed=4)
    np.testing.assert_array_equal(here.apex, [*run.table["apex"], np.nan])
    np.testing.assert_array_equal(here.miss, [*(run.table["apex"] - 0.2), np.nan])
    assert int(here.hops) == 2 and str(here.status.values) == run.status == "completed"
    assert np.isnan(found.miss.sel(controller="3 A")).all()
    exact = found.miss.sel(controller="exact", errors="none")
    assert float(abs(exact).max()) < 1e-9 < float(abs(found.miss.sel(controller="exact", errors="noise")).max())


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"controllers": {}}, "controllers must be at least one"),
        ({"controllers": [1.0]}, "controllers must be"),
        ({"grounds": []}, "grounds must be at least one"),
        ({"grounds": [[]]}, "terrain must have at least one height"),
        ({"seeds": []}, "hops to compare must be 1 to"),
        ({"seeds": [-1]}, r"seeds\[0\] must be"),
        ({"errors": {"a": 1.0}}, "errors a, seed 0: errors must be Errors"),
        ({"controllers": {"low": hopform.hopping.controllers.FeedForward(-0.2)}}, "controller low, ground 0"),
    ],
)
def test_what_cannot_be_compared_is_refused_by_name(changed, said):
    asked = {"controllers": {"none": 0.0}, "grounds": [[0.0]], "height": 0.2} | changed
    with pytest.raises(HopformError, match=said):
        hopform.hopping.compare(HOPPER, **asked)


def test_a_name_that_is_not_known_is_refused_before_its_value_and_before_anything_that_lacks():
    for inputs, said in (
        ({"hieght": [0.1, 0.2]}, "'hieght' is neither an input .*, did you mean 'height'"),
        ({"height": 0.1, "B1": "much"}, "'B1' is neither an input .*, did you mean 'b1'"),
        ({"v2": "fast", "stifness": 3.0}, "'stifness' is neither an input"),
    ):
        with pytest.raises(HopformError, match=said):
            hopform.sweep(HOPPER, **inputs)
