"""What `hopform COMMAND --help` prints: arguments, options by what they are about, and two examples."""

from typing import Any

from typer.core import TyperCommand

from hopform._cli.options import OPTIONS, key_of

EXAMPLES = {
    "robots": ("robots", "robots hopper_c --toml"),
    "equations": ("equations", "equations 14"),
    "stance": ("stance --height 0.20 --u 3", "stance --v2 -1.9 --u-steps 0:0,0.05:2.0 --csv stance.csv"),
    "hop": ("hop --height 0.20 --u 3", "hop --height 0.20 --terrain uniform --controller exact --h-des 0.20"),
    "record": ("record drop --seed 1 --csv drop.csv", "record ramp --plan"),
    "identify": ("identify check drop.csv --known m_s=3", "identify drop drop.csv --known m_s=3 --out mine.toml"),
    "control": ("control --height 0.20 --h-des 0.20", "control --v2 -1.9 --h-des 0.15 --printed"),
    "reach": ("reach --from 0.05 --to 0.35", "reach --heights 5 --currents 4 --json"),
    "figures": ("figures pictures --only 12", "figures pictures --only 9,15 --json"),
    "export": ("export firmware --for cmake", "export single --f32 --prefix leg"),
    "selftest": ("selftest", "selftest --json"),
}  # fmt: skip
"""Two command lines each; a test runs them, those of `record` before those of `identify`."""


class GroupedCommand(TyperCommand):
    """A command whose help groups its options."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Arguments, then each group that the command has, then what is in none."""
        groups: dict[str, list[tuple[str, str]]] = {name: [] for name in OPTIONS}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                own = parameter.name == "help"
                groups["Options" if own else key_of(str(self.name), str(parameter.name))[0]].append(record)
        for name, records in groups.items():
            if records:
                with formatter.section(name):
                    formatter.write_dl(records)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """The examples, each on a line of its own."""
        with formatter.section("Examples"):
            for line in EXAMPLES[str(self.name)]:
                formatter.write(f"  hopform {line}\n")
