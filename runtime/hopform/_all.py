"""All that `hopform` offers; it imports this when the first of it is asked for. It stands above all rooms of the core,
and loads those that bind what a result has from above: flights, explanations, pictures.
"""

import hopform._explain  # pyright: ignore[reportUnusedImport]
import hopform._figures  # noqa: F401  # pyright: ignore[reportUnusedImport]
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
from hopform._flights import Flights, solve_flights
from hopform._hops import Hops, solve_hops
from hopform._motion import Event, Motion, Phase, State
from hopform._robots import ROBOTS, Robot, load_robot
from hopform._sensitivities import ManySensitivities, Sensitivities
from hopform._solver.library import library_message
from hopform._solver.package import CLAIMS, EQUATIONS, Claim, Energy, Equation, FlightLedger, Gains, Ledger
from hopform._solvers import Solver, load_solver
from hopform._stance import Stance, solve_motion, solve_stance, touchdown_velocity
from hopform._sweep import sweep


def equations() -> tuple[Equation, ...]:
    """The register: each equation of the paper as printed, as derived, a verdict, the reason, the code that computes
    it.

    >>> [equation.number for equation in equations()] == list(range(1, 28))
    True
    """
    return EQUATIONS


def claims() -> tuple[Claim, ...]:
    """What the paper claims in words: each with where it stands, a verdict, numbers of the shipped robots, the reason.

    >>> [claim.name for claim in claims() if claim.verdict == "reversed as printed"]
    ['significant_improvement']
    """
    return CLAIMS


__all__ = [
    "BackendError", "Batch", "choose_current", "choose_current_as_printed", "Claim", "claims", "Command",
    "design_return", "Energy", "Equation", "equations", "Event", "FixedPoint", "Flight", "FlightLedger",
    "FlightPhase", "Flights", "Gains", "HopformError", "Hops", "Ledger", "library_message", "load_robot", "load_solver",
    "ManySensitivities", "MissingExtra", "Motion", "Motions", "next_apex", "Phase", "PrintedCommand",
    "Reachability", "reachability", "Robot", "ROBOTS", "Sensitivities", "solve_flight", "solve_flights", "solve_hops",
    "solve_motion",
    "solve_motions", "solve_stance", "solve_stances", "Solver", "Stance", "State", "sweep", "touchdown_velocity",
]  # fmt: skip

# What a solver has beside its own, from below.
Solver._offered = {name: globals()[name] for name in __all__}  # pyright: ignore[reportPrivateUsage]
