"""The exact stance of a series-elastic hopper with dry friction, in microseconds.

    >>> import hopform
    >>> robot = hopform.load_robot("hopper_c")
    >>> stance = hopform.solve_stance(robot, v2=hopform.touchdown_velocity(robot, 0.2), u=3.0)
    >>> stance.status, round(stance.duration, 5), round(stance.apex, 5), round(stance.aed, 4)
    ('takeoff', 0.18813, 0.22329, 1.9216)

Importing hopform loads NumPy alone. Equation numbers are those of the paper that the register (`hopform.equations`) covers.
"""

from hopform import controllers, terrain, ufuncs
from hopform.backends import backends, library_message
from hopform.batch import Batch, solve_stances
from hopform.control import Command, choose_current
from hopform.errors import BackendError, HopformError, MissingExtra
from hopform.flight import Flight, FlightLedger, FlightPhase, design_return, solve_flight
from hopform.hopping import Errors, Hop, Run, simulate
from hopform.printed import PrintedCommand, choose_current_as_printed
from hopform.reaching import FixedPoint, Reachability, next_apex, reachability
from hopform.robots import ROBOTS, Robot, load_robot
from hopform.sensitivities import ManySensitivities, Sensitivities
from hopform.stance import Energy, Event, Ledger, Phase, Stance, State, solve_stance, touchdown_velocity
from hopform.touchdown import TouchdownDetector, delayed_apex
from hopform_solver.equations import EQUATIONS, Equation
from hopform_solver.records import Gains

__version__ = "0.1.0"


def equations() -> tuple[Equation, ...]:
    """The register: each equation of the paper as printed, as derived, a verdict, the reason, the code that computes it.

    >>> [equation.number for equation in equations()] == list(range(1, 28))
    True
    """
    return EQUATIONS


__all__ = [
    "BackendError",
    "Batch",
    "Command",
    "Energy",
    "Equation",
    "Errors",
    "Event",
    "Flight",
    "FlightLedger",
    "FlightPhase",
    "Gains",
    "FixedPoint",
    "Hop",
    "HopformError",
    "Ledger",
    "ManySensitivities",
    "MissingExtra",
    "Phase",
    "PrintedCommand",
    "Reachability",
    "ROBOTS",
    "Robot",
    "Run",
    "Sensitivities",
    "Stance",
    "State",
    "TouchdownDetector",
    "__version__",
    "backends",
    "choose_current",
    "delayed_apex",
    "controllers",
    "design_return",
    "choose_current_as_printed",
    "equations",
    "library_message",
    "load_robot",
    "simulate",
    "solve_flight",
    "next_apex",
    "reachability",
    "solve_stance",
    "solve_stances",
    "terrain",
    "touchdown_velocity",
    "ufuncs",
]
