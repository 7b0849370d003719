"""What `hopform COMMAND --help` prints: arguments, options by what they are about, and two examples."""

from typing import Any

from typer.core import TyperCommand

GROUPS = {
    "Robot and start": "robot height v2 x1 v1 x2",
    "Ground": "terrain size hops",
    "Current": "controller u u_steps h_des datum stop_margin gains model printed",
    "Errors of sensors and motor":
        "noise_x1 noise_v1 noise_x2 noise_v2 noise_ground current_scale hop.quantum hop.delay hop.seed",
    "Map": "lowest highest heights currents",
    "Experiment": "duration rate record.noise record.quantum current hold added_mass repeats spring record.seed plan",
    "Fit": "known force identify.delay gain clock lag loss",
    "Uncertainty of a fit": "from_fit draws control.seed reach.seed",
    "Figures": "only recordings format width caption style",
    "Solver": "horizon max_phases backend dtype",
    "Output": "samples sensitivities json toml c csv hops_csv npz plot out report export",
}  # fmt: skip
"""Options by group; `command.option` where other commands mean something else by the name."""

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
        groups: dict[str, list[tuple[str, str]]] = {name: [] for name in ("Arguments", *GROUPS, "Options")}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                is_argument = parameter.param_type_name == "argument"
                groups["Arguments" if is_argument else self._group_of(str(parameter.name))].append(record)
        for name, records in groups.items():
            if records:
                with formatter.section(name):
                    formatter.write_dl(records)

    def _group_of(self, option: str) -> str:
        wanted = {option, f"{self.name}.{option}"}
        return next((group for group, names in GROUPS.items() if wanted & set(names.split())), "Options")

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """The examples, each on a line of its own."""
        with formatter.section("Examples"):
            for line in EXAMPLES[str(self.name)]:
                formatter.write(f"  hopform {line}\n")
