"""What people call, with arguments that are right: the catalogue for tests that replace some of them by wrong ones."""

import inspect
import os
from collections.abc import Callable, Iterator
from functools import wraps
from typing import Any

import numpy as np

import hopform
import hopform.hopping
import hopform.identify

GOOD = {"m_eff": 25.0, "m_s": 3.0, "k": 1200.0, "L0": 0.4}
HOPPER = hopform.load_robot("hopper_c")


def prepared(controller):
    """A controller as `simulate` asks for it: made, then checked against robot and terrain."""

    @wraps(controller)
    def made(**settings):
        return controller(**settings).prepare(HOPPER, (0.0,))

    return made


DECAY = hopform.identify.record(HOPPER, "decay", height=0.04, duration=0.5, seed=1)
STEP = hopform.identify.record(HOPPER, "step", duration=0.5, rate=200.0, seed=1)
FIT = hopform.identify.fit_robot(decays=DECAY, known={"m_s": 3.0}, compare=False, holdout=False, diagnose=False)
START = {"robot": HOPPER, "v2": -1.9}
FLOOR = {"hops": 3, "size": 0.02}
TOUCHDOWN = hopform.hopping.controllers.Touchdown(0, 0.2, 0.0, 0.0, -1.9, 0.0, 0.2, HOPPER)
RUN = hopform.hopping.simulate(HOPPER, [0.0], 3.0, height=0.2)
CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "solve_stance": (hopform.solve_stance, START),
    "solve_motion": (hopform.solve_motion, {"robot": HOPPER, "start": {"v2": -1.9}}),
    "solve_motions": (hopform.solve_motions, {"robot": HOPPER, "start": {"v2": [-1.9]}}),
    "load_solver": (hopform.load_solver, {"name_or_folder": "hopper"}),
    "solve_stances": (hopform.solve_stances, START),
    "solve_flight": (hopform.solve_flight, START | {"v2": 1.9}),
    "solve_hops": (hopform.solve_hops, {"robot": HOPPER, "height": 0.2, "hops": 2}),
    "solve_flights": (hopform.solve_flights, START | {"v2": [1.9, 1.0], "gains": (9e3, 6e2), "times": [0.0, 0.1]}),
    "choose_current": (hopform.choose_current, START | {"h_des": 0.2}),
    "choose_current_as_printed": (hopform.choose_current_as_printed, START | {"h_des": 0.2}),
    "simulate": (hopform.hopping.simulate, {"robot": HOPPER, "terrain": [0.0], "height": 0.2}),
    "next_apex": (hopform.next_apex, {"robot": HOPPER, "height": 0.2, "u": 1.0}),
    "reachability": (hopform.reachability, {"robot": HOPPER, "heights": [0.1, 0.2], "currents": [0.0]}),
    "touchdown_velocity": (hopform.touchdown_velocity, {"robot": HOPPER, "height": 0.2}),
    "design_return": (hopform.design_return, {"robot": HOPPER, "time": 0.3}),
    "delayed_apex": (hopform.hopping.delayed_apex, START | {"delay": 0.01, "u": 1.0}),
    "sweep": (hopform.sweep, START),
    "compare": (
        hopform.hopping.compare,
        {"robot": HOPPER, "controllers": {"0 A": 0.0}, "grounds": [[0.0]], "height": 0.2},
    ),
    "animate": (hopform.hopping.animate, {"run": RUN, "seconds": 0.1, "rate": 5}),
    "record": (hopform.identify.record, {"robot": HOPPER, "test": "drop"}),
    "Robot": (hopform.Robot, dict(GOOD)),
    "Errors": (hopform.hopping.Errors, {}),
    "TouchdownDetector": (hopform.hopping.TouchdownDetector, {}),
    "flat": (hopform.hopping.terrain.flat, {"hops": 3}),
    "steps": (hopform.hopping.terrain.steps, FLOOR),
    "uniform": (hopform.hopping.terrain.uniform, FLOOR),
    "gaussian": (hopform.hopping.terrain.gaussian, FLOOR),
    "generate": (hopform.hopping.terrain.generate, FLOOR | {"name": "steps"}),
    "ConstantCurrent": (hopform.hopping.controllers.ConstantCurrent, {}),
    "FeedForward": (hopform.hopping.controllers.FeedForward, {"h_des": 0.2}),
    "AsPrinted": (prepared(hopform.hopping.controllers.AsPrinted), {"h_des": 0.2}),
    "ReturnMap": (prepared(hopform.hopping.controllers.ReturnMap), {"h_des": 0.2, "heights": 3, "currents": 3}),
    "Sampled": (hopform.hopping.controllers.Sampled, {"period": 0.001, "law": lambda t, state: 0.0}),
}
"""What takes numbers."""
OTHERS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "load_robot": (hopform.load_robot, {"name_or_path": "hopper_c"}),
    "read": (hopform.hopping.terrain.read, {"path": "nowhere.csv"}),
    "read_recording": (hopform.identify.read_recording, {"path": "nowhere.csv"}),
    "fit": (hopform.identify.fit, {"solver": "hopper", "recordings": DECAY, "known": {"q": 1.0}}),
    "fit_drop_test": (hopform.identify.fit_drop_test, {"recordings": DECAY, "known": {"q": 1.0}}),
    "fit_force": (hopform.identify.fit_force, {"solver": "slide", "recordings": STEP, "known": {"q": 1.0}}),
    "fit_robot": (hopform.identify.fit_robot, {"decays": [DECAY], "known": {"q": 1.0}}),
    "simulator_file": (hopform.identify.simulator_file, {"fit": FIT, "form": "mjcf"}),
    "heights_of": (hopform.hopping.terrain.heights_of, {"terrain": [0.0]}),
    "prepare exact": (hopform.hopping.controllers.FeedForward(0.2).prepare, {"robot": HOPPER, "terrain": [0.0]}),
    "prepare printed": (hopform.hopping.controllers.AsPrinted(0.2).prepare, {"robot": HOPPER, "terrain": [0.0]}),
    "ask exact": (hopform.hopping.controllers.FeedForward(0.2), {"touchdown": TOUCHDOWN}),
    "ask printed": (hopform.hopping.controllers.AsPrinted(0.2), {"touchdown": TOUCHDOWN}),
    "ask return map": (hopform.hopping.controllers.ReturnMap(0.2, heights=3, currents=3), {"touchdown": TOUCHDOWN}),
    "equations": (hopform.equations, {}),
    "claims": (hopform.claims, {}),
    "library_message": (hopform.library_message, {}),
}
"""What takes none, or takes them within something else. A fit is refused for a name that it does not know, so that
what is right about it takes no time."""
ANSWERS = {
    "Batch", "Claim", "Command", "Energy", "Equation", "Event", "FixedPoint", "Flight", "FlightLedger", "FlightPhase", "Flights", "Gains",
    "Animation", "Fit", "Hop", "Hops", "Ledger", "ManySensitivities", "Motion", "Motions", "Phase", "PrintedCommand", "Reachability", "Recording", "ReturnMaps", "Run",
    "Sensitivities", "Solver", "Stance", "State", "Touchdown", "Tracking",
}  # fmt: skip
"""Classes that hopform fills itself, and records that are checked where they are handed in."""
OF_RECORDINGS = {"fit", "fit_drop_test", "fit_force", "fit_robot", "read_recording"}
"""What takes numbers by name, in `known`, or beside a file."""
INSIDE = {
    "check_set_points", "check_touchdown", "crossing", "measured", "number_of", "set_point", "set_points", "target_of",
}  # fmt: skip
"""What controllers and terrains share, behind the classes and functions above."""
OBJECTS: dict[str, Any] = {
    "stance": hopform.solve_stance(HOPPER, v2=-1.9),
    "resting stance": hopform.solve_stance(HOPPER, v2=-0.01),
    "flight": hopform.solve_flight(HOPPER, v2=1.9),
    "flights": hopform.solve_flights(HOPPER, v2=[1.9, 1.0], times=[0.1], events=True, sensitivities=True),
    "run": RUN,
    "hop": RUN.hops[0],
    "command": hopform.choose_current(HOPPER, v2=-1.9, h_des=0.2),
    "detector": hopform.hopping.TouchdownDetector(),
    "batch": hopform.solve_stances(HOPPER, v2=[-1.9, -1.0], events=True, sensitivities=True),
    "runs of hops": hopform.solve_hops(HOPPER, height=[0.1, 0.2], hops=2),
    "map": hopform.reachability(HOPPER, [0.1, 0.2], [0.0]),
    "sensitivities": hopform.solve_stance(HOPPER, v2=-1.9).sensitivities,
    "many sensitivities": hopform.solve_stances(HOPPER, v2=[-1.9], sensitivities=True).sensitivities,
}
METHODS: dict[str, dict[str, Any]] = {
    "at": {"t": 0.0}, "energy": {"t": 0.0}, "ledger": {"t": 0.0}, "compression": {"t": 0.0}, "foot": {"t": 0.0},
    "total_energy": {"t": 0.0}, "forces": {"t": 0.0}, "ledger_by_element": {"t": 0.0}, "derivatives": {"t": 0.0},
    "current": {"t": 0.0}, "ground": {"t": 0.0}, "aed": {"t": 0.0}, "aed_at": {"t": 0.0}, "motion": {"t": [0.0]}, "grid": {"count": 3}, "gaps": {"row": 0},
    "detect": {"samples": [0.0]},
    "false_alarm_rate": {"noise": 0.1},
    "false_takeoff_rate": {"noise": 0.1},
    "mean_delay": {"noise": 0.1},
    "chances": {"noise": 0.1, "signal": [0.0]},
    "simulated_delays": {"noise": 0.1, "trials": 1},
    "to_npz": {"path": os.devnull, "samples": 3},
    "to_csv": {"path": os.devnull},
    "times": {"samples": 3}, "arrays": {"samples": 3}, "archive": {"samples": 3},
    "__getitem__": {"names": ("apex", "u")},
}  # fmt: skip
"""What methods take."""


def methods() -> Iterator[tuple[str, Callable[..., Any], dict[str, Any]]]:
    """Name, method and arguments of every public method of an object, and of its brackets."""
    for name, of in OBJECTS.items():
        for method, call in inspect.getmembers(of, inspect.ismethod):
            if (name, method) == ("resting stance", "fly"):
                continue  # nothing follows from it
            if method == "__getitem__" or not method.startswith("_"):
                taken = inspect.signature(call).parameters
                yield f"{name} {method}", call, {k: v for k, v in METHODS.get(method, {}).items() if k in taken}


def every() -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Every public function, class and method by its name, with arguments that are right."""
    return CALLS | OTHERS | {name: (call, arguments) for name, call, arguments in methods()}


def parameters_of(call: Callable[..., Any], arguments: dict[str, Any]) -> list[str]:
    """The names of all arguments that a call takes; where it takes any, those that it documents."""
    taken = inspect.signature(call).parameters.values()
    names = [each.name for each in taken if each.kind not in (each.VAR_KEYWORD, each.VAR_POSITIONAL)]
    if any(each.kind == each.VAR_KEYWORD for each in taken):
        names += ["loss", "compare", "holdout", "progress", "k", "m_s", "no_such_name"]
    return sorted({*names, *arguments})


def arrays() -> list[Any]:
    """Arrays of every sort that is none of real numbers, or too large, or both."""
    return [
        np.array(1.0), np.array([1.0]), np.array([]), np.zeros((2, 2)), np.zeros((0, 3)), np.array([1, 2]),
        np.array(["1.0"]), np.array([1j]), np.array([True]), np.array([None]), np.array([object()]),
        np.array(["2020-01-01"], "datetime64[D]"), np.array([1], "timedelta64[s]"), np.zeros(2, "f4,i4"),
        np.array([np.nan, 1.0]), np.array([np.inf]), np.array(b"1"), np.array([2**63], np.uint64),
        np.array([1.0], np.longdouble), np.array([1.0], np.float16), np.array([1.0], ">f8"),
        np.broadcast_to(0.0, (10**7, 10**7)), np.broadcast_to(-1.0, (10**9,)), np.broadcast_to(0.1, (10**5, 1)),
        np.ma.masked, np.ma.array([1.0, 2.0], mask=[True, False]), np.ma.array([1.0]),
    ]  # fmt: skip
