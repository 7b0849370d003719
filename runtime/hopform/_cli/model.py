"""The commands about model files: `hopform model check`, `build`, `list` and `show`.

A model file is a program, and reading it runs it. The derivation, and what compiles, is imported when it is asked for.
"""

import ast
import json as json_module
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rich.console import RenderableType

from hopform import HopformError
from hopform import model as door
from hopform._building import Made, in_one_line, no_compiler, readable, solver_of
from hopform._cli.options import Form
from hopform._cli.output import deliver, show, spaced, table
from hopform._errors import printable
from hopform._explain import poles_in_words
from hopform._files import name_of
from hopform._progress import progress_bar
from hopform._solver.choice import DEFAULT
from hopform._solver.folder import FACTS, Facts, built_solvers, facts_in, folder_at


def derived(model: str) -> Any:
    """The Derivation of a model file, or of a model that ships."""
    with in_one_line():
        return door.derive(readable(model))


def spelled(derivation: Any, formula: str | None, form: Form, f32: bool = False, whole: bool = False) -> str:
    """Formulas of a derivation as they are pasted."""
    if f32 and form != Form.c:
        raise HopformError(f"--f32 goes with --as c, got --as {form}")
    with in_one_line():
        return str(derivation.show(formula, str(form), single=f32, whole=whole))


# ---- hopform model show, hopform model check ----


def model_show(
    model: str,
    formula: str | None = None,
    form: Form = Form.text,
    f32: bool = False,
    whole: bool = False,
    mode: str = "nothing",
) -> None:
    """Print the formulas that follow from a model, to paste.

    The formulas go into a paper, a notebook or firmware. FORMULA is a name, a group (lagrangian, equations_of_motion, transfer,
    numerators, poles, partial_fractions, states, energies, works, control, event_functions) or a number of the paper.
    A formula uses the names of others, which are defined before it. --whole gives it in parameters, inputs, start and
    time alone: short parts are substituted, long ones defined first. The C is a header that compiles as it is.
    """
    derivation = derived(model)
    with in_one_line():
        of_mode = derivation.mode(mode)
    print(spelled(of_mode, formula, form, f32, whole), end="")


def model_check(model: str) -> None:
    """Check a model file: what can be solved with it, or why not.

    It prints accelerations, energies, event functions and modes. This runs the file as Python: read it first.
    """
    derivation = derived(model)
    facts = door.part("emit.facts").facts(derivation.model, "", {})
    groups = ("equations_of_motion", "energies", "event_functions")
    formulas = {group: [each for each in derivation.formulas if each.group == group] for group in groups}
    headings = door.part("maths.formulas").GROUPS
    defaults = {each.name: each.default for each in derivation.model.parameters}
    poles = "denominator" if None in defaults.values() else "poles [1/s] at the defaults"
    deliver((), (), "", lambda: spaced(
        printable(f"{facts['name']}: {facts['title']}"),
        "\n".join(map(printable, door.part("emit.facts").abilities(facts))),
        *(table(headings[group], ("name", "formula", "unit"), rows_of(formulas[group]), ("name", "formula", "unit"))
          for group in groups),
        table("Modes", ("held", "slips", "order", poles, "must be >= 0"), list(modes(derivation, defaults)),
              ("held", "slips", poles, "must be >= 0")),
        next_step(model),
    ))  # fmt: skip


def rows_of(formulas: list[Any]) -> list[tuple[str, str, str]]:
    return [(each.name, str(each.value), each.quantity.unit) for each in formulas]


def modes(derivation: Any, defaults: Mapping[str, float | None]) -> Iterator[tuple[str, ...]]:
    """The modes of a model: what is held, what slips, the order, the poles of the defaults, or the denominator where a
    parameter has none, and the conditions that a robot may violate.
    """
    stability = door.part("maths.stability")

    def found(denominator: Any) -> str:
        if None in defaults.values():
            s, count = denominator.gen, denominator.degree()
            powers = ((s ** (count - n), each) for n, each in enumerate(denominator.all_coeffs()))
            return " + ".join(str(power * each) for power, each in powers if each != 0) if count else ""
        return ", ".join(poles_in_words(stability.poles_of(denominator, defaults)))

    for each in derivation.modes:
        conditions = "; ".join(f"{name} = {value}" for name, value in each.conditions.items())
        held, slips = (", ".join(names) or "nothing" for names in (each.held, each.slipping))
        yield held, slips, str(each.order), found(each.denominator), conditions
        if derivation.model.law is not None and each.slipping:
            yield (
                held,
                f"{slips}, under the law",
                str(each.order),
                found(stability.denominator_under_law(derivation.model)),
                "",
            )


def next_step(model: str) -> str:
    return printable(
        f"Next: `hopform model build {model}` builds its solver, `hopform model show {model}` prints its formulas."
    )


# ---- hopform model build ----


def model_build(model: str, out: Path | None = None) -> None:
    """Build the solver of a model file.

    The solver is a folder with a Python package, a compiled library, equations and default parameters. This runs the
    file as Python, and later the solver: read the file first. Without --out the solver goes to the cache, under a hash
    of the model, hopform and the compiler, so a second build is a look-up. Without a C compiler the library is missing;
    it is compiled at first use where there is a compiler.
    """
    with progress_bar("deriving") as bar:
        made = solver_of(readable(model), out, bar)
    facts, library = facts_in(made.folder / FACTS), folder_at(made.folder).library
    warnings = (
        ()
        if library.is_file()
        else (
            f"the library is not compiled ({no_compiler()}); it is compiled at first use where there is a C compiler",
        )
    )
    deliver((), warnings, "", lambda: summary(made, facts))


def summary(made: Made, facts: Facts) -> Iterator[RenderableType]:
    """What there is now, and how it is used."""
    folder, seconds = made
    done = "was built before, in" if seconds is None else "is built in"
    after = "" if seconds is None else f", after {seconds:.1f} s"
    yield printable(f"{facts.name}: {facts.title}")
    yield f"The solver {done} {name_of(folder)}{after}. It can: {', '.join(facts.can)}."
    yield f"Its equations: {name_of(folder / 'EQUATIONS.md')}. Its default parameters: {name_of(folder / 'robot.toml')}."


# ---- hopform model list ----


def model_list(json: bool = False) -> None:
    """List the solvers that are built, and the models that ship.

    One solver ships with hopform; the others are those that `model build` put into the cache. `model build NAME` builds the
    solver of a model that ships.
    """
    found = [entry(DEFAULT.facts, DEFAULT.folder.library, None)]
    found += [entry(facts_in(at / FACTS), folder_at(at).library, at) for at, _ in built_solvers()]
    there = {each["name"] for each in found}
    for name, path in door.shipped().items():
        title = (ast.get_docstring(ast.parse(path.read_text("utf-8"))) or "").partition("\n")[0]
        if name not in there:
            found.append({"name": name, "title": title, "can": [], "compiled": False, "folder": None})
    if json:
        print(json_module.dumps(found, indent=2))
        return
    newest = {each["name"]: each for each in found}  # that which its name means
    rows = [(each["name"], ", ".join(each["can"]), "yes" if each["compiled"] else "no", where_of(each), each["title"])
            for each in newest.values()]  # fmt: skip
    head = ("name", "can", "compiled", "where", "title")
    older = len(found) - len(newest)
    said = [f"older builds of these names: {older}; --json lists them"] if older else []
    show([table("", head, [tuple(map(printable, row)) for row in rows], head), *said])


def where_of(found: dict[str, Any]) -> str:
    """Where a solver of the list is, or how it is made."""
    made = "ships with hopform" if found["can"] else f"`--solver {found['name']}` builds it"
    return found["folder"] or made


def entry(facts: Facts, library: Path, folder: Path | None) -> dict[str, Any]:
    """A solver in the list; a folder of None is that of hopform itself."""
    where = None if folder is None else str(folder)
    return {
        "name": facts.name,
        "title": facts.title,
        "can": list(facts.can),
        "compiled": library.is_file(),
        "folder": where,
    }
