"""The command line: `hopform stance --robot hopper_c --height 0.2 --u 3`, and its sisters.

Exit codes: 0, there is an answer, whatever it is; 2, bad input, one line on the error stream says which, and nothing
was written; 1, a fault of hopform, or a pipe that was closed. A command's module is imported when the command is
called.
"""

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from hopform import __version__
from hopform._errors import HopformError

UsageError: type[Exception] = typer.BadParameter.__bases__[0]
"""What typer raises for a command line that it cannot read; it has no public name in every version of typer."""

SETTINGS: dict[str, Any] = {
    "add_completion": False, "rich_markup_mode": None, "pretty_exceptions_enable": False,
    "context_settings": {"help_option_names": ["-h", "--help"]},
}  # fmt: skip

COMMANDS = {
    "robots": ("solve", "Show the shipped robots, or one robot with all its parameters."),
    "equations": (
        "solve",
        "Show the register of the paper's equations: what is right, what is not, and where it is computed.",
    ),
    "stance": ("solve", "Solve one stance: its phases, events, ending, apex and energy ledger."),
    "hop": (
        "solve",
        "Drop the robot and let it hop, over rough terrain and under a controller: heights and energy over time.\n\n"
        "The terrain is flat, steps, uniform, gaussian (with --size and --seed) or a CSV file of heights. The "
        "controllers: constant (--u), exact (the energy-based feedforward), printed (the same as the paper prints "
        "it), return-map (Hopper B's first one).",
    ),
    "identify": (
        "identify",
        "Identify a robot from CSV recordings: drop tests, step responses, slow ramps of the current, or all together.",
    ),
    "record": (
        "identify",
        "Make a synthetic recording of a robot, as a lab would record it, to plan experiments with.",
    ),
    "control": ("solve", "Choose the current after which the next apex is the desired one, (25)-(27)."),
    "reach": (
        "solve",
        "Map the next apex over the current one for all currents (Figs. 5, 11): bounds, gaps, fixed points, what can "
        "be held.",
    ),
    "figures": (
        "figures",
        "Draw the paper's figures 2 to 17 from this project's robots, and the hopper on rough ground.\n\n"
        "Each becomes an SVG and a PNG with its caption; captions.md has the captions of what was drawn, "
        "animation.gif moves.",
    ),
    "export": (
        "export",
        "Write the C library for firmware: sources, amalgamated pair, README, costs, and a build system's manifest.",
    ),
    "selftest": ("export", "Print the words of the C library's selftest, which a board must repeat."),
}
"""The module of a command, and its help, which stands here so that `hopform --help` needs none of them."""


class Command(TyperCommand):
    """A command of which no more than name and help is known until it is called."""

    def loaded(self) -> Any:
        """The command with its options."""
        name = str(self.name)
        one = typer.Typer(**SETTINGS)
        one.command(name, help=self.help)(getattr(import_module(f"hopform._cli.{COMMANDS[name][0]}"), name))
        return typer.main.get_command(one)

    def make_context(self, *arguments: Any, **named: Any) -> Any:
        """The context of the command with its options."""
        return self.loaded().make_context(*arguments, **named)


app = typer.Typer(**SETTINGS)
for _name, (_, _help) in COMMANDS.items():
    app.command(_name, cls=Command, help=_help)(lambda: None)


@app.callback(invoke_without_command=True)
def front(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="print the version and exit")] = False,
) -> None:
    """The exact stance of a series-elastic hopper with dry friction.

    Numbers are in SI units and A, written without units. Exit code 2 means bad input.
    """
    if version:
        from hopform._solver.library import backends, library_message

        print(f"hopform {__version__} (back ends: {', '.join(backends())})")
        if reason := library_message():
            print(reason)
    elif context.invoked_subcommand is None:
        print(context.get_help())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line on `arguments` (the process's own if None) and return the exit code."""
    reconfigure = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None and sys.stdout.errors == "strict":  # names of files may hold what no encoding does
        reconfigure(errors="backslashreplace")
    try:
        code = app(args=arguments, prog_name="hopform", standalone_mode=False)
        sys.stdout.flush()
    except HopformError as error:
        return refuse(str(error))
    except UsageError as error:
        return refuse(getattr(error, "format_message", error.__str__)())
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (typer.Abort, KeyboardInterrupt):
        return 130
    return code if isinstance(code, int) else 0


def refuse(message: str) -> int:
    """Say in one line what is wrong with the input."""
    print("hopform:", " ".join(message.split()), file=sys.stderr)
    return 2
