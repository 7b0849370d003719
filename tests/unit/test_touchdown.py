"""Touchdown from a noisy signal: what the detector returns, how often it is fooled, how late it is, what that costs."""

import ctypes
import doctest
import itertools
import math
import re
from pathlib import Path

import numpy as np
import pytest

import hopform
from hopform._solver import c as native
from hopform.hopping._touchdown import TouchdownDetector, delayed_apex
from tests import needs

DETECTORS = [
    TouchdownDetector(),
    TouchdownDetector(count=1),
    TouchdownDetector(high=0.5, low=0.5, count=4),
    TouchdownDetector(high=0.9, low=0.2, count=2, dt=5e-4),
]


def test_noise_between_the_thresholds_is_no_event():
    assert TouchdownDetector(high=0.6, low=0.4, count=1).detect([0.5, 0.41, 0.59, 0.5]) == ()


def test_a_signal_that_is_above_stays_so_down_to_the_lower_threshold():
    detector = TouchdownDetector(high=0.6, low=0.4, count=3)
    assert [event.kind for event in detector.detect([0.7, 0.41, 0.41])] == ["touchdown"]
    assert detector.detect([0.7, 0.39, 0.7, 0.7]) == ()
    assert detector.detect([0.59, 0.59, 0.59]) == ()


def test_a_touchdown_is_detected_at_the_last_of_the_samples_in_a_row_and_a_takeoff_too():
    samples = [0.0] * 4 + [1.0] * 6 + [0.0] * 5
    events = TouchdownDetector(count=3, dt=1e-3).detect(samples)
    assert events == (hopform.Event(6e-3, "touchdown"), hopform.Event(12e-3, "takeoff"))


def read_as_the_docstring_says(detector, samples):
    """Above: beyond `high` until a sample is below `low`. An event: `count` samples in a row on the other side."""
    above, touches, sides, events = False, False, [], []
    for n, sample in enumerate(samples):
        above = sample >= (detector.low if above else detector.high)
        sides = [*sides, above][-detector.count :]
        if sides == [not touches] * detector.count:
            touches, sides = not touches, []
            events.append((n, 1 if touches else 2))
    return events


@pytest.mark.parametrize("detector", DETECTORS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_signal_of_noise_is_read_as_the_rule_says(detector, dtype):
    detect, contact, found = detects_in_c(detector, dtype), (0, 0, 0), []
    samples = np.random.default_rng(7).normal(0.5, 0.4, 5000).astype(dtype).tolist()
    for n, sample in enumerate(samples):
        contact, event = detect(contact, sample)
        found += [(n, event)] if event else []
    assert found == read_as_the_docstring_says(detector, samples)
    assert len(found) > 10


def detects_in_c(detector, dtype=np.float64):
    library = native.library()
    types = library.types(np.dtype(dtype))
    settings = struct(types.real, detector)

    def detect(contact, sample):
        known = CONTACT(*contact)
        status = library.call("touchdown", types, ctypes.byref(settings), ctypes.byref(known), types.real(sample))
        return (known.above, known.touches, known.run), status

    return detect


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_a_run_of_count_samples_is_needed_whatever_the_contact_held(count):
    """Of a run that this detector cannot have left, 1 .. count - 1, nothing is kept: not of a longer detector's, not of
    memory that nobody set.
    """
    detect = detects_in_c(TouchdownDetector(high=0.6, low=0.4, count=count))
    runs = (-(2**31), -1, 0, 1, count - 1, count, count + 1, 100, 2**31 - 1)
    for above, touches, run in itertools.product((0, 1), (0, 1), runs):
        contact, kept = (above, touches, run), run if 0 < run < count else 0
        for left in range(count - kept - 1, -1, -1):
            contact, event = detect(contact, -1.0 if touches else 2.0)
            assert event == (0 if left else 2 if touches else 1), (above, touches, run, left)
            assert 0 <= contact[2] < count
        assert tuple(contact) == (not touches, not touches, 0)
        contact, event = detect((above, touches, run), 2.0 if touches else -1.0)
        assert (tuple(contact), event) == ((touches, touches, 0), 0)


class CONTACT(ctypes.Structure):
    _fields_ = [(name, ctypes.c_int32) for name in ("above", "touches", "run")]


def struct(real, detector):
    fields = [("high", real), ("low", real), ("count", ctypes.c_int32)]
    return type("Detector", (ctypes.Structure,), {"_fields_": fields})(detector.high, detector.low, detector.count)


@needs.library
def test_c_refuses_a_sample_that_is_no_number_and_keeps_what_it_knows():
    library = native.library()
    types = library.types(np.dtype(np.float64))
    known = CONTACT(1, 0, 2)
    good, bad = TouchdownDetector(), struct(types.real, TouchdownDetector())
    bad.low = 2.0
    for settings, sample in itertools.product((struct(types.real, good),), (math.nan, math.inf, -math.inf)):
        with pytest.raises(hopform.HopformError, match="a sample or threshold is not finite"):
            library.call("touchdown", types, ctypes.byref(settings), ctypes.byref(known), types.real(sample))
    with pytest.raises(hopform.HopformError, match="low > high"):
        library.call("touchdown", types, ctypes.byref(bad), ctypes.byref(known), types.real(0.0))
    assert (known.above, known.touches, known.run) == (1, 0, 2)


# ---- noise ----


@pytest.mark.parametrize("detector", needs.the_first(DETECTORS[::-1]))
def test_false_alarms_are_as_frequent_as_predicted(detector):
    """A long signal of noise alone, forgotten after each alarm:
    the count of a Poisson-like process within five deviations.
    """
    noise, samples = 0.6, np.random.default_rng(11).normal(0.0, 0.6, 400_000).tolist()
    detect, contact, alarms = detects_in_c(detector), (0, 0, 0), 0
    for sample in samples:
        contact, event = detect(contact, sample)
        if event:
            alarms, contact = alarms + 1, (0, 0, 0)
    expected = detector.false_alarm_rate(noise) * detector.dt * len(samples)
    assert expected > 500
    assert abs(alarms - expected) <= 5.0 * math.sqrt(expected)


@pytest.mark.parametrize("detector", DETECTORS)
@pytest.mark.parametrize("noise", [0.1, 0.3, 0.6])
def test_delays_are_as_long_as_predicted(detector, noise):
    delays = detector.simulated_delays(noise, trials=20_000, seed=3)
    assert abs(np.mean(delays) - detector.mean_delay(noise)) <= 5.0 * np.std(delays) / math.sqrt(delays.size)


@pytest.mark.parametrize("detector", DETECTORS)
def test_without_noise_the_delay_is_that_of_the_samples(detector):
    assert detector.mean_delay(1e-6) == pytest.approx((detector.count - 0.5) * detector.dt, rel=1e-12)
    assert detector.false_alarm_rate(1e-6) == 0.0
    assert detector.mean_delay(1e-6, level=0.1) == math.inf, "a signal that does not reach the threshold"


@pytest.mark.parametrize("detector", DETECTORS)
def test_the_chances_of_a_step_have_the_mean_delay(detector):
    chances = detector.chances(0.3, [1.0] * 3000)
    assert math.fsum(chances) == pytest.approx(1.0, abs=1e-12)
    mean = math.fsum(chances * (np.arange(3000) + 0.5)) * detector.dt
    assert mean == pytest.approx(detector.mean_delay(0.3), rel=1e-10)


def test_the_chances_of_a_ramp_are_those_of_draws():
    """A signal that grows with the compression of the spring, as in Fig. 15."""
    detector, noise, ramp = TouchdownDetector(), 0.2, np.minimum(np.arange(60) / 20.0, 1.5)
    draw, trials = np.random.default_rng(5), 4000
    counted = np.zeros(ramp.size)
    for _ in range(trials):
        events = detector.detect(ramp + draw.normal(0.0, noise, ramp.size))
        first = next((event for event in events if event.kind == "touchdown"), None)
        if first is not None:
            counted[round(first.time / detector.dt)] += 1
    chances = detector.chances(noise, ramp.tolist())
    assert np.all(np.abs(counted - trials * chances) <= 5.0 * np.sqrt(trials * chances) + 3.0)


def test_a_false_takeoff_is_a_false_alarm_upside_down():
    detector = TouchdownDetector(high=0.7, low=0.4, count=2)
    mirrored = TouchdownDetector(high=1.0 - 0.4, low=1.0 - 0.7, count=2)
    assert detector.false_takeoff_rate(0.3) == pytest.approx(mirrored.false_alarm_rate(0.3), rel=1e-13)


def test_more_samples_are_safer_and_later():
    rates = [TouchdownDetector(count=n).false_alarm_rate(0.4) for n in range(1, 8)]
    delays = [TouchdownDetector(count=n).mean_delay(0.4) for n in range(1, 8)]
    assert rates == sorted(rates, reverse=True)
    assert delays == sorted(delays)


# ---- what a delay costs ----


def test_a_delay_of_nothing_costs_nothing(hopper_c):
    apex, error = delayed_apex(hopper_c, 0.0, v2=-1.93, u=3.0)
    assert error == 0.0
    assert apex == hopform.solve_stance(hopper_c, v2=-1.93, u=3.0).apex


def test_a_delay_longer_than_the_stance_is_a_stance_without_the_current(hopper_c):
    apex, _ = delayed_apex(hopper_c, 1.0, v2=-1.93, u=3.0, before=1.0)
    assert apex == pytest.approx(hopform.solve_stance(hopper_c, v2=-1.93, u=1.0).apex, abs=1e-15)


def test_the_apex_is_lost_smoothly_with_the_delay(hopper_c):
    """The actuator is held until 0.30 A, so an early delay acts as its time: half of it costs half, to second order."""
    errors = [delayed_apex(hopper_c, delay, v2=-1.93, u=3.0)[1] for delay in (1e-5, 2e-5, 4e-5)]
    assert errors[0] < 0.0
    assert errors[1] / errors[0] == pytest.approx(2.0, abs=1e-2)
    assert errors[2] / errors[1] == pytest.approx(2.0, abs=1e-2)


# ---- bad input ----


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"high": math.nan}, "high must be finite units of the signal, got nan"),
        ({"high": 0.3, "low": 0.4}, "low must be <= high = 0.3, got 0.4"),
        ({"count": 0}, "count must be a whole number >= 1, got 0"),
        ({"count": 2.5}, "count must be a whole number >= 1, got 2.5"),
        ({"dt": 0.0}, "dt must be > 0 s, got 0.0"),
    ],
)
def test_a_detector_refuses_what_it_cannot_be(arguments, message):
    with pytest.raises(hopform.HopformError, match=f"^{re.escape(message)}$"):
        TouchdownDetector(**arguments)


def test_what_it_is_asked_is_checked(hopper_c):
    detector = TouchdownDetector()
    with pytest.raises(hopform.HopformError, match=r"^noise must be > 0 units of the signal, got 0\.0$"):
        detector.false_alarm_rate(0.0)
    with pytest.raises(hopform.HopformError, match=r"^samples\[1\] must be finite units of the signal, got nan$"):
        detector.detect([0.0, math.nan])
    with pytest.raises(hopform.HopformError, match=r"^trials must be a whole number >= 1, got 0$"):
        detector.simulated_delays(0.2, trials=0)
    with pytest.raises(hopform.HopformError, match=r"^delay must be >= 0 s, got -0\.1$"):
        delayed_apex(hopper_c, -0.1, v2=-1.9, u=1.0)


def test_the_page_on_touchdown_is_true():
    page = Path(__file__).parents[2] / "docs" / "how-to" / "detect-touchdown.md"
    outcome = doctest.testfile(str(page), module_relative=False)
    assert outcome.attempted >= 6
    assert outcome.failed == 0
