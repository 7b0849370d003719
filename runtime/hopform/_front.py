"""The command line: `hopform stance --robot hopper_c --height 0.2 --u 3`, and its sisters.

Exit codes: 0, there is an answer, whatever it is; 2, bad input, one line on the error stream says which, and nothing
was written; 1, a fault of hopform, or a pipe that was closed. A command's module is imported when the command is
called.
"""

import ast
import os
import re
import sys
import warnings
from collections.abc import Sequence
from contextvars import copy_context
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from hopform import __version__
from hopform._errors import HopformError, printable

UsageError: type[Exception] = typer.BadParameter.__bases__[0]
"""The exception of typer for a command line that it cannot read; it has no public name in every version of typer."""

SETTINGS: dict[str, Any] = {
    "rich_markup_mode": None, "pretty_exceptions_enable": False,
    "context_settings": {"help_option_names": ["-h", "--help"]},
}  # fmt: skip

COMMANDS = {
    "robots": "_cli.solve", "equations": "_cli.solve", "motion": "_cli.solve", "stance": "_cli.solve",
    "hop": "hopping._commands", "identify": "identify._commands", "fit": "identify._fit_command", "record": "identify._commands",
    "control": "_cli.solve", "reach": "_cli.solve", "export": "_cli.folders", "selftest": "_cli.folders",
    "model check": "_cli.model", "model build": "_cli.model", "model list": "_cli.model", "model show": "_cli.model",
    "model prove": "_cli.prove",
    "reference list": "_cli.reference", "reference score": "_cli.reference", "reference write": "_cli.reference",
}  # fmt: skip
"""The module of each command, of whichever room; one in a group has two words."""

GROUPS = {
    "model": (
        "Check, build, show and prove models of mechanisms.",
        "A model file is Python code: each of these runs it.",
    ),
    "reference": (
        "Score a simulator against exact motions with dry friction.",
        "A benchmark of states, events and derivatives.",
    ),
}
"""What the commands of a group are about, in a sentence, and what else there is to say."""


SOLVER = "hopform.solver"
"""Under which a context has what --solver names."""

ABOUT_SOLVER = "solver to use, a name from `model list` or a folder as in ./DIR (runs its code); default: hopform's own"

LONGEST = 2000
"""Characters of a message at most."""


class Group(TyperGroup):
    """Commands, of which `help` is none: `hopform help stance` is `hopform stance --help`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the options of the group; first that of the solver, on which its help depends."""
        if (solver := self.make_parser(ctx).parse_args(args=list(args))[0].get("solver")) is not None:
            from hopform._cli.named import NAMED

            NAMED.set(solver)
            ctx.meta[SOLVER] = solver
        return list(super().parse_args(ctx, args))

    def list_commands(self, ctx: Any) -> list[str]:
        """The names of its commands that the solver in use has."""
        names = super().list_commands(ctx)
        if SOLVER not in ctx.meta:
            return names
        from hopform._cli.named import refusal

        return [name for name in names if refusal(name) is None]

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """The command that the words name, and the words that are left for it; HopformError for one that the solver in
        use does not have.
        """
        if args[0] == "help":
            if args[1:] in ([], ["help"]):
                print(ctx.get_help())
                ctx.exit()
            args = [*args[1:], "--help"]
        if SOLVER in ctx.meta:
            from hopform._cli.named import refusal

            if ctx.parent is None and (error := refusal(args[0])) is not None:
                raise error
        return super().resolve_command(ctx, args)

    def format_help_text(self, ctx: Any, formatter: Any) -> None:
        """What it is about: the model of the solver in use, where one is named, in place of the hopper."""
        if SOLVER in ctx.meta and ctx.parent is None:
            from hopform._cli.named import facts_in_use

            about, (_, _, rest) = facts_in_use(), (self.help or "").partition("\n\n")
            self.help = f"{printable(f'{about.name}: {about.title}')}\n\n{rest}"
        super().format_help_text(ctx, formatter)


class Command(TyperCommand):
    """A command of which only the words are known until it is called or helped with."""

    words: str

    def loaded(self) -> Any:
        """The command with its options."""
        from hopform._cli.options import EXAMPLES, GroupedCommand, described, options_beside

        one = typer.Typer(add_completion=False, **SETTINGS)
        module = import_module(f"hopform.{COMMANDS[self.words]}")
        options, examples = options_beside(getattr(module, "OPTIONS", {})), EXAMPLES | getattr(module, "EXAMPLES", {})
        function = getattr(module, self.words.replace(" ", "_"))
        one.command(self.name, cls=GroupedCommand)(described(self.words, function, options))
        command: Any = typer.main.get_command(one)
        command.words, command.options, command.examples = self.words, options, examples[self.words]
        return command

    def make_context(self, *arguments: Any, **named: Any) -> Any:
        """The context of the command with its options."""
        return self.loaded().make_context(*arguments, **named)

    def get_short_help_str(self, limit: int = 45) -> str:
        """The first line of its docstring, a sentence, read without an import; whole, whatever the limit."""
        text = Path(__file__).parent.joinpath(*f"{COMMANDS[self.words]}.py".split(".", 1)).read_text("utf-8")
        functions = [node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)]
        about = next(ast.get_docstring(node) for node in functions if node.name == self.words.replace(" ", "_"))
        return (about or "").partition("\n")[0]


app = typer.Typer(cls=Group, **SETTINGS)
_groups = {name: typer.Typer(cls=Group, **SETTINGS) for name in GROUPS}
for _name, _group in _groups.items():
    app.add_typer(_group, name=_name, help=" ".join(GROUPS[_name]), short_help=GROUPS[_name][0])

    @_group.callback(invoke_without_command=True)
    def _(context: typer.Context) -> None:
        if context.invoked_subcommand is None:
            print(context.get_help())


for _words in COMMANDS:
    *_of, _name = _words.split()
    _kind = type("Command", (Command,), {"words": _words})
    (_groups[_of[0]] if _of else app).command(_name, cls=_kind)(lambda: None)


def commands() -> dict[str, Any]:
    """Every command with its options, by its words."""
    found: dict[str, Any] = {}
    for words in COMMANDS:
        command: Any = typer.main.get_command(app)
        for word in words.split():
            command = command.commands[word]
        found[words] = command.loaded()
    return found


@app.callback(invoke_without_command=True)
def front(
    context: typer.Context,
    solver: Annotated[str | None, typer.Option("--solver", metavar="DIR|NAME", help=ABOUT_SOLVER)] = None,
    version: Annotated[bool, typer.Option("--version", help="print the version and exit")] = False,
) -> None:
    """Exact motions of joints, hoppers and any mechanism of one or two masses with dry friction, stops and contact.
    Commands are about the hopper unless --solver names another model; `hopform model list` lists joints, carts and more.

    Numbers are in SI units, written without units. Exit code 2 means bad input. `hopform COMMAND
    --help` lists the options of a command, with examples.
    """
    if version:
        from hopform._solver.library import library_message

        print(f"hopform {__version__}")
        if reason := library_message():
            print(reason)
        raise typer.Exit
    if context.invoked_subcommand is None:
        print(context.get_help())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line on `arguments` (the process's own if None) and return the exit code."""
    reconfigure = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None and sys.stdout.errors == "strict":  # names of files may hold what no encoding does
        reconfigure(errors="backslashreplace")
    try:
        with warnings.catch_warnings():
            warnings.showwarning = warn
            code = copy_context().run(app, args=arguments, prog_name="hopform", standalone_mode=False)
        if sys.stdout is not None:
            sys.stdout.flush()
    except HopformError as error:
        return refuse(str(error))
    except UsageError as error:
        message = getattr(error, "format_message", error.__str__)()
        if getattr(error, "option_name", None) == "--solver":
            message = "--solver stands before the command: hopform --solver DIR|NAME COMMAND ..."
        return refuse(re.sub(r"^(Invalid value for [^:]+: )Value error, ", r"\1", message))
    except MemoryError:
        return refuse("there is not enough memory for that many numbers")
    except OSError as error:  # of the standard output, mostly: files are checked where they are read and written
        if sys.stdout is not None:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not isinstance(error, BrokenPipeError):
            print(f"hopform: cannot go on: {error.strerror}", file=sys.stderr)
        return 1
    except (typer.Abort, KeyboardInterrupt):
        return 130
    return code if isinstance(code, int) else 0


def warn(message: Warning | str, *_: object, **__: object) -> None:
    """A warning of Python is its text alone: where in which file it arose is no concern of whoever calls a command."""
    if sys.stderr is not None:
        print("hopform: warning:", one_line(str(message)), file=sys.stderr)


def one_line(message: str) -> str:
    """A message as a line of limited length."""
    text = printable(" ".join(message.split()))
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def refuse(message: str) -> int:
    """Say in one line what is wrong with the input."""
    print("hopform:", one_line(message), file=sys.stderr)
    return 2
