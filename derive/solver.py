"""The folder of a solver: what is rendered of a model, and beside it the model file, numbers to start from, and the page
of its equations.
"""

from collections.abc import Iterator
from pathlib import Path

from .derivation import Derivation
from .emit.examples import example_value
from .emit.render import render
from .emit.texts import line
from .emit.toml import key_of, value_of
from .ir import Quantity
from .model.equations import Model, ModelError
from .model.names import KEYS_OF_ROBOTS
from .model.precisions import PRECISIONS, Precision
from .model.quantities import TRAVEL
from .model_file import read_model
from .page import page
from .shipped import FILES, shipped

MODEL, ROBOT, EQUATIONS = (Path(name) for name in ("model.py", "robot.toml", "EQUATIONS.md"))


def source_of(model: str | Path) -> str:
    """The text of a model file, or of a model that ships; ModelError if it cannot be read."""
    path = FILES.get(str(model), Path(model))
    try:
        return path.read_text("utf-8")
    except (OSError, ValueError) as error:
        raise ModelError(f"{model} cannot be read: {error}") from None


def model_of(model: str | Path) -> Model:
    """The model of a file, which is run as Python, or one that ships."""
    return shipped(str(model)) if str(model) in FILES else read_model(Path(model))


def solver(model: str | Path, precisions: tuple[Precision, ...] = PRECISIONS) -> dict[Path, str]:
    """The text of every file of the folder of a solver, by path in it."""
    mechanism, text = model_of(model), source_of(model)
    robot = "".join(f"{line}\n" for line in numbers_of(mechanism))
    return render(mechanism, precisions) | {MODEL: text, ROBOT: robot, EQUATIONS: page(Derivation(mechanism))}


def numbers_of(model: Model) -> Iterator[str]:
    """The lines of a robot to start from: the defaults of parameters, and for the hopper's own those of its examples."""
    yield f"name = {value_of(model.name)}"
    yield f"model = {value_of(model.name)}"
    yield f"description = {value_of(f'defaults of the model file. {model.title}')}"
    quantities = model.robot.quantities
    for each in quantities:
        if each.name not in KEYS_OF_ROBOTS:
            yield _number(each, float(example_value(each)))
    if model.has_contact:
        yield _number(TRAVEL, TRAVEL.default)
    if apart := [each for each in quantities if each.name in KEYS_OF_ROBOTS]:
        yield from ("", "[parameters]", *(_number(each, float(example_value(each))) for each in apart))


def _number(quantity: Quantity, value: float | None) -> str:
    """A line with the value of a parameter, its unit and its meaning."""
    return f"{f'{key_of(quantity.name)} = {value_of(value)}':<24} # {line(f'[{quantity.unit}] {quantity.meaning}')}"
