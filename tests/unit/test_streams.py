"""Random streams: the numbers that are drawn for one purpose say nothing about those that are drawn for another."""

import inspect
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hopform
import hopform.hopping
from hopform._robots import Provenance
from hopform.hopping import terrain
from hopform.hopping.controllers import Sampled
from tests.calls import CALLS, OBJECTS

HOPPER = replace(hopform.load_robot("hopper_c"), x1_min=-1.0, x1_max=1.0)
"""Its stops clip no measured x1."""

SIZE = 600
"""Numbers of a stream: the correlation of independent ones has a standard deviation of 0.04."""

LARGEST = 0.2
"""Five standard deviations: independent streams exceed it in one of 100 such tests, and the seeds are fixed."""

HOPS = SIZE // 5
SIGMA = {"small": 1e-4, "middle": 1e-3, "large": 2e-3}
Streams = dict[tuple[object, ...], np.ndarray]


def errors_of(sigma: float) -> hopform.hopping.Errors:
    return hopform.hopping.Errors(x1=sigma, v1=sigma, x2=sigma, v2=sigma, ground=sigma)


def compared(currents: tuple[float, ...], grounds: int, seeds: list[int], hops: int = HOPS) -> Streams:
    """What the sensors add at the touchdowns of a comparison, in standard deviations, by current and cell.

    The currents do not depend on what is measured, so the runs without errors have the same states.
    """
    seen: list[tuple[float, ...]] = []

    def law(u):
        return lambda t: seen.append((t.x1, t.v1, t.v2, t.ground, t.apex)) or u

    kinds = {"none": hopform.hopping.Errors(), **{name: errors_of(sigma) for name, sigma in SIGMA.items()}}
    rough = [terrain.uniform(hops, 0.02, seed=n) for n in range(grounds)]
    hopform.hopping.compare(HOPPER, {str(u): law(u) for u in currents}, rough, kinds, seeds, height=0.2)
    found = np.array(seen).reshape(len(currents), grounds, len(kinds), len(seeds), -1)
    return {
        (u, ground, name, seed): (found[i, ground, k, n] - found[i, ground, 0, n]) / SIGMA[name]
        for i, u in enumerate(currents) for ground in range(grounds)
        for k, name in enumerate(SIGMA, 1) for n, seed in enumerate(seeds)
    }  # fmt: skip


def ticks(seed: int) -> Streams:
    """What the sensors add at the ticks of a sampled law, by hop."""
    seen = []
    law = Sampled(1e-3, lambda t, state: seen.append((t, *state)) or 3.0)
    run = hopform.hopping.simulate(HOPPER, [0.0, 0.0], lambda _: law, height=0.2, errors=errors_of(1e-3), seed=seed)
    begins = [n for n, (t, *_) in enumerate(seen) if t == 0.0]
    parts = (np.array(seen[begin:end]) for begin, end in zip(begins, [*begins[1:], None], strict=True))
    return {
        ("ticks", seed, hop.index): ((part[:, 1:] - np.transpose(hop.stance.at(part[:, 0]))) / 1e-3).ravel()[:SIZE]
        for hop, part in zip(run.hops, parts, strict=True)
    }


def drawn() -> Streams:
    """Streams of everything that takes a seed, many with the same one."""
    fit = Provenance(("k",), (1200.0,), (1190.0,), (1210.0,), ((25.0,),), (), "", True)
    identified, detector = replace(HOPPER, k=1200.0, fit=fit), hopform.hopping.TouchdownDetector(count=1)
    found = compared((3.0,), 3, [0, 1, 2, 3]) | ticks(0) | ticks(1)
    for seed in range(55):
        found["uniform", seed] = np.array(terrain.uniform(SIZE, 1.0, seed))
        found["gaussian", seed] = np.array(terrain.gaussian(SIZE, 1.0, seed))
        found["delays", seed] = detector.simulated_delays(1e-3, trials=SIZE, seed=seed)
    for seed in range(6):
        found["robots", seed] = np.array([each.k for each in identified.sample(SIZE, seed)])
    return found


@pytest.mark.sliced
def test_streams_that_are_not_meant_to_be_one_are_not_correlated():
    streams = drawn()
    assert len(streams) > 200 and {each.shape for each in streams.values()} == {(SIZE,)}
    related = np.abs(np.corrcoef([*streams.values()]) - np.eye(len(streams)))
    one, other = np.unravel_index(int(related.argmax()), related.shape)
    names = [*streams]
    assert related.max() < LARGEST, f"{names[one]} and {names[other]}"


def test_controllers_meet_the_same_errors():
    found = compared((3.0, 2.7), 2, [4, 5], hops=4)
    for (u, *cell), errors in found.items():
        np.testing.assert_allclose(errors, found[(3.0, *cell)], rtol=0.0, atol=1e-9, err_msg=f"{u} A, {cell}")


def test_the_errors_of_a_touchdown_do_not_depend_on_how_often_was_measured_before():
    seen: dict[str, list[float]] = {"sampled": [], "constant": []}
    law = Sampled(0.05, lambda t, state: 3.0)
    for name, answer in (("sampled", law), ("constant", 3.0)):

        def controller(touchdown, name=name, answer=answer):
            seen[name].append(touchdown.ground)
            return answer

        hopform.hopping.simulate(HOPPER, [0.0] * 4, controller, height=0.2, errors=errors_of(1e-3), seed=6)
    assert seen["sampled"] == seen["constant"] and len(set(seen["constant"])) == 4


def test_a_tick_does_not_repeat_the_errors_of_its_touchdown():
    ticks, touchdowns = [], []
    law = Sampled(0.05, lambda t, state: ticks.append(state.v1) or 3.0)
    run = hopform.hopping.simulate(
        HOPPER, [0.0], lambda seen: touchdowns.append(seen.v1) or law, height=0.2, errors=errors_of(1e-3)
    )
    assert run.hops[0].touchdown.v1 != ticks[0] != touchdowns[0]


def test_every_function_that_takes_a_seed_is_drawn_from():
    seeded = {name for name, (call, _) in CALLS.items() if "seed" in inspect.signature(call).parameters}
    assert seeded == {"simulate", "record", "uniform", "gaussian", "generate"}  # generate calls the two before it
    methods = {
        method
        for of in [*OBJECTS.values(), HOPPER]
        for method, call in inspect.getmembers(of, inspect.ismethod)
        if not method.startswith("_") and "seed" in inspect.signature(call).parameters
    }
    assert methods == {"simulated_delays", "sample"}


def test_the_package_seeds_generators_in_one_place():
    """But recordings, and the optimiser's starting points and the noise of a current again, which no seed of a user draws."""
    package = Path(inspect.getfile(hopform)).parent
    seeding = {path.name for path in package.rglob("*.py") if re.search(r"default_rng\([^)]", path.read_text("utf-8"))}
    assert seeding == {"_checks.py", "_current_noise.py", "_search.py", "_synthetic.py"}


@pytest.mark.parametrize(
    ("cell", "said"),
    [(0, "cell must be a pair"), ((0, -1), r"cell\[1\] must be a whole number >= 0"), ((0.5, 0), r"cell\[0\] must be")],
)
def test_a_cell_is_a_pair_of_whole_numbers(cell, said):
    with pytest.raises(hopform.HopformError, match=said):
        hopform.hopping.simulate(HOPPER, [0.0], 3.0, height=0.2, cell=cell)
