"""The solver that `hopform --solver DIR|NAME` names: its facts, which are read without NumPy and without running it."""

from contextvars import ContextVar
from pathlib import Path

from hopform._errors import HopformError
from hopform._solver.folder import FACTS, SHIPPED, Facts, facts_in, folder_of, is_name

NAMED: ContextVar[str | None] = ContextVar("NAMED", default=None)
"""What --solver names; None without it."""

NEEDED = {
    "equations": "stance", "stance": "stance", "hop": "hop", "identify": "identify", "control": "command", "reach": "reach",
}  # fmt: skip
"""What a model has to be able to, of `folder.ACTS`, by the command that needs it; the others are for every model."""


def facts_in_use() -> Facts:
    """The facts of the solver of this command line; HopformError where it names none."""
    named = NAMED.get()
    if named is None or named == SHIPPED.facts.name:
        return SHIPPED.facts
    folder = folder_of(named) if is_name(named) else Path(named)
    if folder is not None and (folder / FACTS).is_file():
        return facts_in(folder / FACTS)
    from hopform import load_solver  # of what is to be built first, or refused

    return load_solver(named).Robot.solver.facts


def refusal(command: str) -> HopformError | None:
    """Why the solver in use has no such command; None where it has."""
    act = NEEDED.get(command)
    if act is None or NAMED.get() is None:
        return None
    facts = facts_in_use()
    if act in facts.can:
        return None
    if command == "equations":
        return HopformError(
            f"the paper's equations are of another model: `hopform model show` prints those of {facts.name}"
        )
    return facts.cannot(act)
