"""Where a hop may lead: bounds, fixed points, gaps, the stroke, what can be held."""

import math

import numpy as np
import pytest

import hopform

HOPPER = hopform.load_robot("hopper_c")
IDEAL = hopform.load_robot("ideal")
HEIGHTS = np.array([0.02, 0.06, 0.12, 0.2, 0.25, 0.3])
CURRENTS = np.linspace(-3.0, 3.0, 121)


@pytest.fixture(scope="module")
def found() -> hopform.Reachability:
    return hopform.reachability(HOPPER, HEIGHTS, CURRENTS)


def test_the_map_is_that_of_single_stances(found):
    for row in (0, 3):
        for column in (0, 60, 85, 120):
            v2 = hopform.touchdown_velocity(HOPPER, HEIGHTS[row])
            apex = hopform.solve_stance(HOPPER, v2=v2, u=CURRENTS[column]).apex
            assert found.apex[row, column] == pytest.approx(apex, abs=0.0, nan_ok=True)


def test_the_next_apex_broadcasts_and_keeps_its_shape():
    apex = hopform.next_apex(HOPPER, HEIGHTS[:, np.newaxis], [0.0, 3.0])
    assert apex.shape == (6, 2)
    assert hopform.next_apex(HOPPER, 0.2, 3.0) == apex[3, 1]
    assert isinstance(hopform.next_apex(HOPPER, 0.2, 3.0), float)
    assert math.isnan(hopform.next_apex(HOPPER, 0.02, 1.1))


def test_the_next_apex_takes_whole_numbers():
    assert hopform.next_apex(HOPPER, 1, [0, 1])[1] == hopform.next_apex(HOPPER, 1.0, 1.0)


def test_the_next_apex_under_a_huge_current_is_that_of_an_actuator_at_its_stop():
    """The time to the stop is 150 decades below that of the stance."""
    apex = hopform.next_apex(HOPPER, 0.2, [1e100, 1e200, 1e300])
    assert apex[1:] == pytest.approx(apex[0], rel=1e-12)
    moderate = hopform.next_apex(HOPPER, 0.2, 1e12)
    assert apex[0] == pytest.approx(moderate, rel=1e-5)


def test_bounds_are_those_of_all_currents_not_of_the_map(found):
    fine = np.linspace(-3.0, 3.0, 4001)
    for row, height in enumerate(HEIGHTS):
        apex = hopform.next_apex(HOPPER, height, fine)
        v2 = hopform.touchdown_velocity(HOPPER, height)
        stances = [hopform.solve_stance(HOPPER, v2=v2, u=u) for u in (found.u_lowest[row], found.u_highest[row])]
        assert [stance.apex for stance in stances] == pytest.approx([found.lowest[row], found.highest[row]], abs=1e-12)
        assert found.lowest[row] <= np.nanmin(apex) + 1e-9
        if row > 0:  # from 2 cm the stroke limits before the current does
            assert found.highest[row] >= np.nanmax(apex) - 1e-9


@pytest.mark.parametrize("currents", [[0.0], [-0.5, 0.5, 1.0]], ids=str)
def test_bounds_do_not_depend_on_the_currents_of_the_map(found, currents):
    """Not even where the map has no current that leads as high or as low."""
    coarse = hopform.reachability(HOPPER, HEIGHTS, currents)
    for name in ("lowest", "u_lowest", "highest", "u_highest", "hold"):
        np.testing.assert_allclose(getattr(coarse, name), getattr(found, name), rtol=0, atol=1e-6, err_msg=name)
    assert np.all(coarse.highest > np.fmax.reduce(coarse.apex, axis=1) + 0.01)


def test_the_stroke_bounds_the_highest_apex_of_low_drops(found):
    """From 2 cm: of a fine scan of stances, the highest of those that keep the actuator off its stop."""
    v2 = hopform.touchdown_velocity(HOPPER, HEIGHTS[0])
    scan = [hopform.solve_stance(HOPPER, v2=v2, u=u) for u in np.linspace(2.5, 3.0, 501)]
    stays = [np.max(each.at(np.linspace(0.0, each.duration, 1001)).x1) < HOPPER.x1_max for each in scan]
    assert any(stays) and not all(stays)
    assert found.highest[0] == pytest.approx(
        max(each.apex for each, off in zip(scan, stays, strict=True) if off), abs=1e-4
    )


def test_the_fixed_point_at_3_ampere_is_25_cm(found):
    point = next(point for point in found.fixed_points if point.u == 3.0)
    assert point.height == pytest.approx(0.252, abs=5e-4)
    assert point.stable
    assert point.admissible


@pytest.mark.parametrize(
    ("multiplier", "stable"), [(0.99, True), (-0.99, True), (1.01, False), (-1.01, False), (math.nan, False)]
)
def test_a_fixed_point_is_stable_where_a_change_of_height_shrinks(multiplier, stable):
    assert hopform.FixedPoint(u=3.0, height=0.2, multiplier=multiplier, admissible=True).stable is stable


def test_a_fixed_point_gives_its_height_back_and_its_multiplier_is_the_slope(found):
    assert len(found.fixed_points) > 10
    for point in found.fixed_points:
        h = 1e-6
        below, at, above = (hopform.next_apex(HOPPER, point.height + d, point.u) for d in (-h, 0.0, h))
        assert at == pytest.approx(point.height, abs=1e-9)
        assert point.multiplier == pytest.approx((above - below) / (2.0 * h), rel=1e-4, abs=1e-5)


JUMPING = hopform.Robot(
    **{
        **HOPPER.parameters._asdict(),
        "m_eff": 3.73,
        "b1": 16.5,
        "b2": 3.77,
        "k": 1134.0,
        "f2": 0.39,
        "f1": 0.2,
        "x1_max": 0.2,
    }
)


def test_a_bracket_that_closes_on_a_jump_holds_no_fixed_point():
    """A light actuator: the leg takes off at its first or at its second rebound,
    and the apex jumps across the diagonal.
    """
    heights, u = np.linspace(0.002, 0.2, 60), 1.0
    found = hopform.reachability(JUMPING, heights, [u])
    gain = found.apex[:, 0] - heights
    crossings = int((np.sign(gain[:-1]) != np.sign(gain[1:])).sum())
    assert crossings > len(found.fixed_points), "no jump"
    for point in found.fixed_points:
        assert abs(hopform.next_apex(JUMPING, point.height, u) - point.height) <= 1e-9


def test_the_gap_of_a_drop_of_2_cm_is_seen(found):
    gaps = found.gaps(0)
    assert any(low == pytest.approx(0.8, abs=0.06) and high == pytest.approx(1.4, abs=0.06) for low, high in gaps)
    assert found.gaps(3) == ()


def test_a_height_is_held_where_the_controller_reaches_it(found):
    for row, height in enumerate(HEIGHTS):
        v2 = hopform.touchdown_velocity(HOPPER, height)
        command = hopform.choose_current(HOPPER, v2=v2, h_des=height)
        assert np.isfinite(found.hold[row]) == (command.status == "reached")
        if command.status == "reached":
            assert found.hold[row] == command.u
    assert np.isfinite(found.hold[3])
    assert not np.isfinite(found.hold[5])


def test_the_margin_takes_away_what_uses_the_stroke(found):
    narrow = hopform.reachability(HOPPER, HEIGHTS, CURRENTS, stop_margin=0.05)
    assert found.admissible.sum() > narrow.admissible.sum() > 0
    assert np.array_equal(narrow.apex, found.apex, equal_nan=True)
    assert np.array_equal(narrow.limited, np.isfinite(narrow.apex) & ~narrow.admissible)
    assert narrow.limited.sum() > found.limited.sum()
    assert np.all(narrow.highest <= found.highest + 1e-12)
    assert narrow.highest[3] < found.highest[3] - 0.01


def test_a_locked_robot_keeps_every_height():
    found = hopform.reachability(IDEAL, [0.1, 0.2], [-1.0, 0.0, 1.0])
    assert found.apex == pytest.approx(np.array([[0.1] * 3, [0.2] * 3]), abs=1e-12)
    assert found.admissible.all()
    assert found.hold.tolist() == [0.0, 0.0]


def test_progress_is_reported_and_may_stop_the_map():
    seen: list[tuple[int, int]] = []
    hopform.reachability(HOPPER, np.linspace(0.1, 0.2, 40), [0.0], progress=lambda *done: seen.append(done))
    assert seen == [(16, 40), (32, 40), (40, 40)]

    def stop(*_: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        hopform.reachability(HOPPER, np.linspace(0.1, 0.2, 40), [0.0], progress=stop)


@pytest.mark.parametrize(
    ("heights", "currents", "options", "said"),
    [
        ([0.2, 0.1], [0.0], {}, "heights must increase, got 0.1 m after 0.2"),
        ([0.1], [1.0, 1.0], {}, "currents must increase"),
        ([], [0.0], {}, "heights must be"),
        ([0.0, 0.1], [0.0], {}, "height must be > 0.0 m, the foot must be above the ground"),
        ([0.1], [math.nan], {}, "currents[0] must be finite A"),
        ([0.1], [0.0], {"stop_margin": -0.1}, "stop_margin must be >= 0 m"),
        ([0.1], [0.0], {"horizon": 0.0}, "horizon must be > 0 s"),
    ],
)
def test_what_is_not_allowed_is_named(heights, currents, options, said):
    with pytest.raises(hopform.HopformError) as caught:
        hopform.reachability(HOPPER, heights, currents, **options)
    assert said in str(caught.value)
