"""The paper's figures, drawn from this project's own robots: one function per figure, each with what it computed and a
caption.

    >>> from hopform._figures import DRAWN
    >>> sorted(DRAWN) == [*range(2, 18)]
    True

`hopform figures DIR` writes them all. Importing this package loads no matplotlib; drawing needs the extra `plot`.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, cast

from hopform._checks import shown
from hopform._errors import HopformError

if TYPE_CHECKING:
    from hopform._figures.picture import Picture

DRAWN: dict[int, tuple[str, str]] = {
    2: ("actuator", "step_response"),
    3: ("actuator", "compression_cycles"),
    4: ("verification", "initial_model"),
    5: ("return_maps", "maps_of_hopper_b"),
    6: ("first_controller", "on_even_ground"),
    7: ("first_controller", "on_uneven_ground"),
    8: ("first_controller", "with_errors_of_measurement"),
    9: ("actuator", "friction_threshold"),
    10: ("verification", "improved_model"),
    11: ("return_maps", "map_of_hopper_c"),
    12: ("energies", "ideal_drop"),
    13: ("energies", "real_drop"),
    14: ("energies", "actuated"),
    15: ("contact", "hall_sensor"),
    16: ("feedforward", "on_even_ground"),
    17: ("feedforward", "on_uneven_ground"),
}
"""The figures by their number in the paper: module and function."""


def draw(number: int) -> "Picture":
    """The figure of a number in `DRAWN`, its caption and its data; HopformError for another, MissingExtra without
    matplotlib."""
    if number not in DRAWN:
        raise HopformError(f"figure must be one of {', '.join(map(str, DRAWN))}, got {shown(number)}")
    import_module("hopform._figures.picture")  # raises MissingExtra
    module, function = DRAWN[number]
    make = cast("Callable[[], Picture]", getattr(import_module(f"hopform._figures.{module}"), function))
    return make()
