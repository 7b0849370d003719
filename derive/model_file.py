"""A model from a file that declares further terms: `python -m derive --model FILE.py`."""

import runpy
from pathlib import Path

import sympy as sp

from derive import flight
from derive import quantities as Q
from derive.model import Model, ModelError
from derive.quantities import side_1, side_2, u, v1, v2, x1, x2


def read_model(path: Path) -> Model:
    """The model of a file that defines `terms` and `parameters`; errors name the file."""
    if not path.is_file():
        raise ModelError(f"--model: there is no file {path}")
    try:
        defined = runpy.run_path(str(path))
        terms = tuple(defined["terms"])
        parameters = tuple(defined.get("parameters", ()))
        taken = {quantity.name for quantity in Q.ROBOT.quantities}
        for parameter in parameters:
            if parameter.name in taken:
                raise ModelError(f"parameter {parameter.name} is one of the robot's already")
        model = Model(terms, parameters)
        for term in terms:
            flight.refuse_what_ends_at_takeoff(term)
    except KeyError as missing:
        raise ModelError(f"{path} must define {missing}: a tuple of derive.model.Term") from None
    except ModelError as error:
        raise ModelError(f"{path}: {error}") from None
    unknown = {symbol for force in model.forces for symbol in force.free_symbols} - _known(model)
    if unknown:
        raise ModelError(f"{path}: {', '.join(sorted(map(str, unknown)))} is not declared in `parameters`")
    return model


def _known(model: Model) -> set[sp.Symbol]:
    return {*model.robot.symbols, x1, x2, v1, v2, u, side_1, side_2}
