"""`python -m derive` derives the formulas and writes generated/; `--check` says whether it is up to date.

With `--model FILE.py --out DIR` the same for the mechanism of a model file. A hopper that is edited in its own file is
another mechanism than the paper's: all follows it but the register of the paper, which is replaced by a line that says
by what it differs, and by the equations of what it is now.
"""

import argparse
import sys
from pathlib import Path

try:
    from .model.equations import ModelError
    from .model.precisions import F32, F64, PRECISIONS

    try:
        from .derivation import Derivation
        from .emit.folder import GENERATED, FolderError, check, lies_in, write
        from .emit.render import render
        from .emit.sources import INSTALLED
        from .page import page
        from .paper.register import DIFFERENCE, FILE
        from .shipped import HOPPER
        from .solver import EQUATIONS, solver
    except ModelError as error:  # of the hopper's own file, which is read here
        print(f"derive: {error}", file=sys.stderr)
        raise SystemExit(2) from None
except ModuleNotFoundError as error:
    if error.name not in ("sympy", "jinja2"):
        raise
    needs = f"python -m {__package__} needs the extra `derive`: {sys.executable} -m pip install 'hopform[derive]'"
    print(f"derive: {needs}", file=sys.stderr)
    raise SystemExit(2) from None


def main(arguments: list[str] | None = None) -> int:
    chosen = _parser().parse_args(arguments)
    try:
        texts = _texts(chosen)
        differs = bool(DIFFERENCE) and chosen.model is None
        if differs:
            own = "a copy of the file is a model of its own, for `hopform model build`"
            print(f"derive: {DIFFERENCE}; {own}", file=sys.stderr)
        if chosen.check:
            return check(texts, chosen.out or GENERATED) or int(differs)
        write(texts, chosen.out or GENERATED)
    except (ModelError, FolderError, OSError) as error:
        print(f"derive: {error}", file=sys.stderr)
        return 2
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=f"python -m {__package__}", description=__doc__.splitlines()[0])
    option = parser.add_argument
    option("--check", action="store_true", help="write nothing; exit 1 and say what differs if it is stale")
    where = "where to write instead of generated/: an empty folder, or one that derive made"
    option("--out", type=Path, metavar="DIR", help=where)
    further = "a mechanism of elements: a file that is run as Python, so read it first; needs --out"
    option("--model", type=Path, metavar="FILE", help=further)
    one = parser.add_mutually_exclusive_group()
    for name, precision, word in (("--float32", F32, "single"), ("--float64", F64, "double")):
        help_ = f"C in {word} precision only"
        one.add_argument(name, action="store_const", const=(precision,), dest="precisions", help=help_)
    return parser


def _texts(chosen: argparse.Namespace) -> dict[Path, str]:
    if INSTALLED and chosen.out is None:
        raise ModelError("--out DIR is needed: there is no checkout whose generated/ this could be")
    own = chosen.model is not None or chosen.precisions is not None
    if own and chosen.out is None:
        raise ModelError("--model, --float32 and --float64 need --out DIR: generated/ holds the hopper of the paper")
    if own and lies_in(chosen.out, GENERATED):
        raise ModelError(f"--out {chosen.out} lies in generated/, which holds the hopper of the paper alone")
    precisions = chosen.precisions or PRECISIONS
    if chosen.model is None:
        return render(precisions=precisions) | _own_equations()
    texts = solver(chosen.model, precisions)
    print(f"derive: {chosen.model} was run as Python", file=sys.stderr)
    return texts


def _own_equations() -> dict[Path, str]:
    """The page of equations of a hopper that is not the paper's, in the place of the register."""
    return {EQUATIONS: f"{DIFFERENCE}\n\n{page(Derivation(HOPPER), FILE)}"} if DIFFERENCE else {}


if __name__ == "__main__":
    raise SystemExit(main())
