"""All that `hopform` offers; it imports this when the first of it is asked for."""

from hopform import __version__, controllers, terrain
from hopform._batch import Batch, Motions, solve_motions, solve_stances
from hopform._control import (
    Command,
    FixedPoint,
    PrintedCommand,
    Reachability,
    choose_current,
    choose_current_as_printed,
    next_apex,
    reachability,
)
from hopform._errors import BackendError, HopformError, MissingExtra
from hopform._flight import Flight, FlightPhase, design_return, solve_flight
from hopform._hopping.run import Errors, Hop, Run, simulate
from hopform._hopping.touchdown import TouchdownDetector, delayed_apex
from hopform._identify.drop import fit_drop_test
from hopform._identify.joint import fit_robot
from hopform._identify.recordings import read_recording
from hopform._identify.simulators import simulator_file
from hopform._identify.step import fit_force, fit_step_response
from hopform._identify.synthetic import record
from hopform._motion import Event, Motion, Phase, State
from hopform._robots import ROBOTS, Robot, load_robot
from hopform._sensitivities import ManySensitivities, Sensitivities
from hopform._show import animate
from hopform._solver.library import library_message
from hopform._solver.package import EQUATIONS, Energy, Equation, FlightLedger, Gains, Ledger
from hopform._solvers import Solver, fit, load_solver
from hopform._stance import Stance, solve_motion, solve_stance, touchdown_velocity
from hopform._studies import compare, sweep


def equations() -> tuple[Equation, ...]:
    """The register: each equation of the paper as printed, as derived, a verdict, the reason, the code that computes
    it.

    >>> [equation.number for equation in equations()] == list(range(1, 28))
    True
    """
    return EQUATIONS


__all__ = [
    "__version__", "animate", "BackendError", "Batch", "choose_current", "choose_current_as_printed",
    "Command", "compare", "controllers", "delayed_apex", "design_return", "Energy", "Equation", "equations", "Errors",
    "Event", "fit", "fit_drop_test", "fit_force", "fit_robot", "fit_step_response", "FixedPoint", "Flight", "FlightLedger",
    "FlightPhase", "Gains", "Hop", "HopformError", "Ledger", "library_message", "load_robot", "load_solver",
    "ManySensitivities", "MissingExtra", "Motion", "Motions", "next_apex", "Phase", "PrintedCommand", "Reachability", "reachability",
    "read_recording", "record", "Robot", "ROBOTS", "Run", "Sensitivities", "simulate", "simulator_file", "solve_flight", "solve_motion", "solve_motions", "solve_stance",
    "solve_stances", "Solver", "Stance", "State", "sweep", "terrain", "touchdown_velocity", "TouchdownDetector",
]  # fmt: skip
