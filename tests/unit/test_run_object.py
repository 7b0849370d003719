"""A run as an object: it can be pickled, copied and sent to other processes; it reports its progress; Ctrl-C ends
it."""

import copy
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import rich.progress

import hopform
import hopform.hopping
from hopform import _front as cli
from hopform import _progress
from hopform._solver import c as native
from hopform.hopping import terrain
from hopform.hopping.controllers import FeedForward, ReturnMap

HOPPER = hopform.load_robot("hopper_c")
ROUGH = terrain.uniform(5, 0.02, seed=5)


def hops(controller=2.9, **how):
    return hopform.hopping.simulate(HOPPER, ROUGH, controller, height=0.2, **how)


def everything(run):
    """All that a run says, as bytes."""
    parts = [run.table.tobytes()]
    parts += [np.ascontiguousarray(each).tobytes() for name, each in run.arrays(300).items() if name != "table"]
    for flight in (*(hop.flight for hop in run.hops), run.last):
        parts += [repr((flight.phases, flight.events, flight.gains, flight.ledger(flight.duration / 3)))]
    return [*parts, repr([hop.stance.phases for hop in run.hops])]


def read_elsewhere(pickled):
    return everything(pickle.loads(pickled))


def hop_elsewhere(height):
    return hopform.hopping.simulate(HOPPER, ROUGH, FeedForward(0.2), height=height)


@pytest.mark.parametrize("copied", [lambda run: pickle.loads(pickle.dumps(run)), copy.deepcopy, copy.copy])
def test_a_run_is_the_same_after_a_pickle_and_a_copy(copied):
    run = hops()
    again = copied(run)
    assert again == run and again.status == "completed"
    assert everything(again) == everything(run)
    assert everything(copied(again)) == everything(run)


def test_a_pickle_is_read_by_a_process_that_starts_afresh():
    run = hops()
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(read_elsewhere, (pickle.dumps(run),)) == everything(run)


def test_runs_come_back_from_a_pool():
    heights = [0.15, 0.2, 0.25]
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        for run, height in zip(pool.map(hop_elsewhere, heights), heights, strict=True):
            assert everything(run) == everything(hop_elsewhere(height))


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_flight_of_many_phases_is_the_same_after_a_pickle(dtype):
    shaken = hopform.Robot(
        **{**HOPPER.parameters._asdict(), "b1": 0.0, "f1": 0.0, "x1_min": -1.0, "x1_max": 1.0, "u_max": 1e3}
    )
    flight = hopform.solve_flight(shaken, x1=0.01, v2=2.0, gains=(1.6e7, 0.0), dtype=dtype)
    again = pickle.loads(pickle.dumps(flight))
    assert len(flight.phases) > native.FIRST_CAPACITY
    assert again.phases == flight.phases and again == flight
    t = np.linspace(0.0, flight.duration, 50, dtype=dtype)
    assert all((one == other).all() for one, other in zip(again.at(t), flight.at(t), strict=True))


def test_a_flight_of_another_library_is_refused():
    flight = hopform.solve_flight(HOPPER, x1=0.01, v2=2.0)
    again, (source, *rest) = flight._solved.__reduce__()
    with pytest.raises(hopform.HopformError, match=f"is of the solver of source {source[:-1]}x, which is not loaded"):
        again(source[:-1] + "x", *rest)


def test_progress_is_reported_after_every_hop():
    seen: list[tuple[int, int]] = []
    hops(progress=lambda *done: seen.append(done))
    assert seen == [(1, 5), (2, 5), (3, 5), (4, 5), (5, 5)]


def test_an_interrupt_in_the_middle_leaves_nothing_that_a_next_run_would_notice():
    before = everything(hops(controller=FeedForward(0.2)))

    def stop(done: int, _: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        hops(controller=FeedForward(0.2), progress=stop)
    assert everything(hops(controller=FeedForward(0.2))) == before


def test_ctrl_c_ends_the_command_with_130_no_traceback_and_no_file(tmp_path):
    code = (
        "import signal, sys; from hopform._front import main; from hopform.hopping import _run as run; begin = run._run; "
        "run._run = lambda *given: (print('ready', flush=True), begin(*given))[1]; "
        "signal.signal(signal.SIGINT, signal.default_int_handler); sys.exit(main())"
    )  # as from a terminal; who runs tests in the background may have it ignored
    out = tmp_path / "hops.csv"
    arguments = ["hop", "--height", "0.2", "--u", "3", "--hops", "60000", "--hops-csv", str(out)]
    with subprocess.Popen(
        [sys.executable, "-c", code, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == "ready\n"
        time.sleep(0.1)  # into the hops
        assert process.poll() is None
        os.kill(process.pid, signal.SIGINT)
        output, errors = process.communicate(timeout=60)
    assert (process.returncode, output, errors) == (130, "", "")
    assert list(tmp_path.iterdir()) == []


def test_the_bar_of_hop_shows_how_far_it_is(monkeypatch, capsys):
    """A bar that only moves says less than one that fills."""
    shares: list[float] = []
    monkeypatch.setattr(_progress, "BAR_AFTER", 0.0)
    monkeypatch.setenv("FORCE_COLOR", "1")
    update = rich.progress.Progress.update

    def seen(bar, task, **change):
        shares.append(change["completed"] / change["total"])
        update(bar, task, **change)

    monkeypatch.setattr(rich.progress.Progress, "update", seen)
    assert cli.main(["hop", "--height", "0.2", "--u", "3", "--hops", "200"]) == 0
    assert shares == sorted(shares) and shares[-1] == 1.0 and len(shares) == 200
    assert "200 hops" in capsys.readouterr().err


def test_a_run_under_a_sampled_law_can_be_pickled_too():
    run = hopform.hopping.simulate(HOPPER, [0.0, 0.01], ReturnMap(0.2), height=0.2)
    assert everything(pickle.loads(pickle.dumps(run))) == everything(run)
