"""The door of the derivation: `derive(FILE | NAME)` gives a model's formulas as objects of sympy."""

from functools import cache, cached_property
from pathlib import Path

from .maths.formulas import GROUPS, free_masses
from .mode import Mode
from .model.equations import ModelError
from .model_file import read_model
from .shipped import FILES, shipped

SHIPPED = tuple(FILES)
"""Names of the models that ship."""


class Derivation(Mode):
    """The derivation of a model: the formulas of the mode in which nothing is held, and the other modes.

    >>> from hopform.model import derive
    >>> hopper = derive("hopper")
    >>> hopper.equations_of_motion["acc_2"]
    (-b2*v2 - f2*m_s*side_2 - g*m_s + k*(L0 + c + x1 - x2))/m_s
    >>> hopper.formula("H2").numbers, hopper.numerators["H2"]
    ((14,), beta*q_1 + beta_1*q_2 - gamma*p_1)
    """

    def __repr__(self) -> str:
        owns = (own for own in self.model.names if own is not None)
        driven = self.model.driven_by
        rows = {
            self.model.name: self.model.title,
            "coordinates": ", ".join(
                f"{own.coordinate} [{own.unit}] of the {own.thing}, velocity {own.velocity}" for own in owns
            ),
            "input": "none" if driven is None else f"{driven.name} [{driven.unit}]",
            "parameters": ", ".join(each.name for each in self.model.parameters),
            "formulas": ", ".join(f"{group} {len(found)}" for group in GROUPS if (found := self._group(group))),
            "modes, by what is held": "; ".join(f"{each.name} (order {each.order})" for each in self.modes),
        }
        return "\n".join(f"{name}: {text}" for name, text in rows.items())

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """The modes of the model, by what is held.

        >>> from hopform.model import derive
        >>> [(each.held, each.order) for each in derive("hopper").modes]
        [((), 3), (('actuator',), 2), (('body',), 2), (('actuator', 'body'), 0)]
        """
        free = free_masses(self.model)
        held_by_size = ((), *((n,) for n in free), *((free,) if len(free) > 1 else ()))
        margins = {
            n: [f"{own.coordinate}_stick_margin_{way}" for way in ("forward", "backward")]
            for n, own in enumerate(self.model.names, 1)
            if own is not None
        }
        return tuple(
            Mode(
                self.model,
                held,
                self.assumptions,
                {name: self.event_functions[name] for n in held for name in margins[n]},
            )
            for held in held_by_size
        )

    def mode(self, name: str) -> Mode:
        """The mode of a name: of what is held, or "nothing".

        Raises ModelError, which says which there are, for another.

        >>> from hopform.model import derive
        >>> derive("hopper").mode("actuator").states["v2_t"]
        H2_2*W + H3_2*Wd + v2_0
        """
        wanted = {each.strip() for each in str(name).split(",")}
        for each in self.modes:
            if wanted == set(each.name.split(", ")):
                return each
        allowed = ", ".join(repr(each.name) for each in self.modes)
        raise ModelError(
            f"a mode of {self.model.name} is named by the masses that are held, one of {allowed}, got {name!r}"
        )


@cache
def _shipped(name: str, assumptions: bool) -> Derivation:
    return Derivation(shipped(name), assumptions=assumptions)


def derive(model: str | Path, *, assumptions: bool = False) -> Derivation:
    """The derivation of a model that ships, by its name, or of a model file, which is run as Python.

    assumptions: whether symbols have those of their domains, positive, nonnegative, real, so that sympy simplifies more;
    else they are plain, as a user's `symbols` and `sympify` make them. `symbols` has either kind by name.

    Raises ModelError, which names the file, for a model that the closed form cannot carry.

    >>> from hopform.model import derive
    >>> derive("hopper").model.title
    'A series-elastic hopper with viscous and Coulomb friction.'
    >>> derive("joint").symbols["J"].is_positive, derive("joint", assumptions=True).symbols["J"].is_positive
    (None, True)
    """
    if str(model) in SHIPPED:
        return _shipped(str(model), assumptions)
    path = Path(model)
    if not path.is_file():
        raise ModelError(f"there is no model file {path}; models that ship: {', '.join(SHIPPED)}")
    return Derivation(read_model(path), assumptions=assumptions)
