"""The command line: what it prints, what it writes, and what it refuses in one line with exit code 2."""

import copy
import csv
import dataclasses
import io
import json
import math
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import hopform
import hopform.hopping
from hopform import _front as cli
from hopform import _progress
from hopform._cli import output, tables
from tests.conformance.test_selftest import CC

GENERATED = Path(__file__).resolve().parents[2] / "generated"
DROP = ("stance", "--height", "0.2", "--u", "3")
HOPPER = hopform.load_robot("hopper_c")
COMMANDS = cli.commands()


@pytest.fixture(autouse=True)
def plain_environment(monkeypatch):
    """What a terminal or a CI may set."""
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE", "COLUMNS", "MPLBACKEND", "DISPLAY"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def run(capsys):
    """Exit code, output and error stream of a command."""

    def call(*arguments):
        code = cli.main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return call


@pytest.fixture
def answer(run):
    """The output of a command that must succeed without a word on the error stream."""

    def call(*arguments):
        code, output, errors = run(*arguments)
        assert (code, errors) == (0, "")
        return output

    return call


@pytest.fixture
def robot_file(tmp_path):
    """A TOML file of hopper_c with changes, made text by text."""

    def write(**changes):
        lines = [line for line in HOPPER.to_toml().splitlines() if line.split(" = ")[0] not in changes]
        path = tmp_path / "mine.toml"
        path.write_text("\n".join([*lines, *(f"{key} = {value}" for key, value in changes.items())]))
        return path

    return write


def python(code, *arguments, **environment):
    """Exit code, output and error stream of a fresh interpreter."""
    command = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | environment, check=False)
    return done.returncode, done.stdout, done.stderr


def strict_json(text):
    def refuse(constant):
        raise AssertionError(f"{constant} is not JSON")

    return json.loads(text, parse_constant=refuse)


# ---- the documented schema ----


def documented():
    """The tables of generated/JSON.md: heading -> field or column -> type or unit."""
    tables: dict = {}
    heading = ""
    for line in (GENERATED / "JSON.md").read_text("utf-8").splitlines():
        if line.startswith("## "):
            heading = line.removeprefix("## ")
        elif match := re.match(r"\| `(\w+)` \| ([^|]*) \|", line):
            tables.setdefault(heading, {})[match[1]] = match[2]
    return tables


SCHEMA = documented()
OBJECTS = json.loads((GENERATED / "schema.json").read_text("utf-8"))["$defs"]


def fits(value, kind):
    """Whether a value is what the schema says of an object, or of what a command prints, its fields in that order."""
    validator = jsonschema.Draft202012Validator({"$defs": OBJECTS, **OBJECTS[kind]})
    return validator.is_valid(value) and list(value) == list(OBJECTS[kind]["properties"])


def test_page_and_schema_have_the_same_fields():
    pages = {heading.strip("`").removesuffix(" --json"): list(fields) for heading, fields in SCHEMA.items()}
    tables = {"CSV of a motion", "CSV of a stance", "CSV of a run", "Table of a run"}
    assert {name: list(each["properties"]) for name, each in OBJECTS.items()} == {
        name: fields for name, fields in pages.items() if name not in tables
    }
    jsonschema.Draft202012Validator.check_schema({"$defs": OBJECTS})


@pytest.mark.parametrize(
    "arguments",
    [
        DROP,
        ("stance", "--v2", "-0.3", "--u", "1"),
        ("stance", "--height", "0.2", "--horizon", "0.01"),
        ("stance", "--height", "0.2", "--max-phases", "1"),
        ("stance", "--x1", "0.04", "--v1", "-0.1", "--v2", "0"),
        ("stance", "--height", "0.02", "--u-steps", "0:0,0.05:2,0.1:-3"),
        ("stance", "--height", "0.2", "--dtype", "float32"),
        ("hop", "--height", "0.2", "--u", "3", "--hops", "2"),
        ("hop", "--height", "0.05", "--hops", "20"),
        ("hop", "--height", "0.2", "--terrain", "uniform", "--seed", "3", "--controller", "exact", "--h-des", "0.2"),
        ("hop", "--height", "0.2", "--hops", "2", "--controller", "return-map", "--h-des", "0.2", "--delay", "0.002"),
        ("hop", "--height", "-0.1"),
        ("robots",),
        ("robots", "ideal"),
        ("equations",),
        ("equations", "--claims"),
        ("equations", "24"),
    ],
)
def test_json_is_strict_and_is_what_the_schema_says(answer, arguments):
    assert fits(strict_json(answer(*arguments, "--json")), f"hopform {arguments[0]}")


def test_the_check_of_the_schema_can_fail():
    assert not fits({"time": 0.0, "kind": "x1_slips", "more": 1}, "event")
    assert not fits({"time": "0.0", "kind": "x1_slips"}, "event")
    assert not fits({"time": 0.0, "kind": "x3_slips"}, "event")
    assert fits({"time": 0.0, "kind": "x1_slips"}, "event")


def test_a_robot_without_limits_has_nulls_in_json(answer, robot_file):
    mine = robot_file(x1_min="-inf", x1_max="inf", u_max="inf")
    record = strict_json(answer("stance", "--robot", mine, "--v2", "-1", "--json"))
    assert (record["robot"]["x1_min"], record["robot"]["x1_max"], record["robot"]["u_max"]) == (None, None, None)


# ---- answers ----


def test_the_version_is_the_packages(answer):
    assert answer("--version").startswith(f"hopform {hopform.__version__}")


@pytest.mark.parametrize("command", [(), *(name.split() for name in COMMANDS)])
def test_help_has_a_short_name_too(answer, command):
    assert answer(*command, "-h") == answer(*command, "--help") != ""


def test_the_module_runs_as_the_command():
    module = [sys.executable, "-m", "hopform"]
    done = subprocess.run([*module, "robots", "ideal"], capture_output=True, text=True, check=True)
    assert "ideal" in done.stdout and done.stderr == ""
    wrong = subprocess.run([*module, "stanc"], capture_output=True, text=True, check=False)
    assert (wrong.returncode, wrong.stdout, wrong.stderr.count("\n")) == (2, "", 1)
    usage = subprocess.run([*module, "stance", "-h"], capture_output=True, text=True, check=True).stdout
    assert "hopform stance" in usage and "__main__" not in usage


def test_without_a_command_the_commands_are_listed(answer):
    output = answer()
    assert all(command in output for command in ("robots", "equations", "stance", "hop"))


def test_the_shipped_robots_are_shown_with_units_and_as_our_own(answer):
    output = answer("robots")
    assert all(name in output for name in hopform.ROBOTS)
    assert all(field.name in output and field.unit in output for field in hopform.Robot.fields())
    assert "the paper gives none" in output


def test_a_robot_of_ones_own_is_shown_without_that_note(answer, robot_file):
    output = answer("robots", robot_file(name='"mine"', m_s="2.5"))
    assert "mine" in output and "sprung mass of the body" in output
    assert "the paper gives none" not in output


@pytest.mark.parametrize("name", hopform.ROBOTS)
def test_the_toml_to_start_from_reads_back(answer, tmp_path, name):
    path = tmp_path / "copy.toml"
    path.write_text(answer("robots", name, "--toml"))
    assert hopform.load_robot(path) == hopform.load_robot(name)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_the_struct_for_c_holds_the_numbers_of_the_robot(answer, robot_file, tmp_path, precision):
    mine = robot_file(m_s="2.7182818284590452", x1_min="-inf", b1="1e-7")
    suffix = precision.replace("float", "f")
    program = tmp_path / "robot.c"
    program.write_text(
        f'#include <stdio.h>\n#include "hopform/hopform.h"\n{answer("robots", mine, "--c", precision)}'
        f"int main(void)\n{{\n    const {'float' if suffix == 'f32' else 'double'} *number = &robot.m_eff;\n"
        "    for (unsigned i = 0; i < sizeof robot / sizeof *number; i++) {\n"
        '        printf("%.17g\\n", (double)number[i]);\n    }\n    return 0;\n}\n'
    )
    include = f"-I{GENERATED / 'c' / 'include'}"
    subprocess.run([*CC, "-std=c99", "-Werror", "-Wall", "-Wextra", "-Wdouble-promotion", include, program, "-o",
                    tmp_path / "robot"], check=True)  # fmt: skip
    printed = subprocess.run([tmp_path / "robot"], capture_output=True, text=True, check=True).stdout
    dtype = np.dtype(precision).type
    assert [float(line) for line in printed.split()] == [float(dtype(x)) for x in hopform.load_robot(mine).parameters]


def test_the_register_has_every_equation_of_the_paper(answer):
    output = answer("equations")
    assert all(f"({number})" in output for number in range(1, 28))


def test_one_equation_is_shown_in_full(answer):
    (shown,) = (equation for equation in hopform.equations() if equation.number == 24)
    output = " ".join(answer("equations", "(24)").split())
    for text in (shown.title, shown.verdict, shown.printed, shown.derived, shown.reason, *shown.computed_by):
        assert text in output


def test_the_claims_are_listed_and_one_is_shown_in_full(answer):
    output = answer("equations", "--claims")
    for claim in hopform.claims():
        assert claim.name in output and claim.says in output and claim.verdict in output
    (shown,) = (claim for claim in hopform.claims() if claim.name == "significant_improvement")
    output = " ".join(answer("equations", shown.name, "--claims").split())
    for text in (shown.name, shown.verdict, shown.says, shown.where, shown.reason):
        assert text in output
    assert all(f"{value} {unit} {what}" in output for what, value, unit in shown.numbers)
    answered = json.loads(answer("equations", "brief_contact", "--claims", "--json"))
    assert answered["equations"] == [] and [each["printed"] for each in answered["claims"]] == ["< 0.25 s"]
    assert json.loads(answer("equations", "14", "--json"))["claims"] == []


def test_of_a_hopper_that_is_not_the_papers_the_register_claims_nothing_and_says_so_first(run, monkeypatch):
    """The package as derive makes it where `derive/models/hopper.py` was edited."""
    why = "(3) of derive/models/hopper.py differs from the paper's by -b1 v1/m_eff"
    package = hopform.load_solver("hopper").Robot.solver.package
    unclaimed = tuple(
        each._replace(verdict="not claimed", derived="", reason=why, computed_by=()) for each in hopform.equations()
    )
    monkeypatch.setattr(package.equations, "EQUATIONS", unclaimed)
    claims = tuple(each._replace(verdict="not claimed", numbers=(), reason=why) for each in hopform.claims())
    monkeypatch.setattr(package.equations, "CLAIMS", claims)
    for arguments in (("--claims",), ("pieces", "--claims")):
        code, output, errors = run("equations", *arguments)
        assert (code, errors, output.splitlines()[0], "reproduced" in output) == (0, "", why, False)
    code, output, errors = run("equations", "--claims", "--json")
    assert (code, errors, "< 1e" in output) == (0, f"hopform: warning: {why}\n", False)
    for arguments in ((), ("3",)):
        code, output, errors = run("equations", *arguments)
        assert (code, errors, output.splitlines()[0], "agrees" in output) == (0, "", why, False)
        assert "not claimed" in output and "as derived" not in output
    for arguments in (("--json",), ("3", "--as", "text")):
        code, output, errors = run("equations", *arguments)
        assert (code, errors) == (0, f"hopform: warning: {why}\n")
        assert output


def test_a_stance_is_printed_in_words_and_units(answer):
    output = answer(*DROP)
    assert "takes off after 188.13 ms, apex 0.2233 m" in output
    assert "84.3887  188.128  body reverses  extends   slips up" in output
    assert "AED 1.92158 J" in output


def test_a_stance_that_rests_says_so(answer):
    output = answer("stance", "--v2", "-0.3", "--u", "1")
    assert "comes to rest after" in output
    assert "actuator hits stop" in output


def test_phases_begin_with_their_events_and_with_steps_of_the_current(answer):
    output = answer("stance", "--height", "0.02", "--u-steps", "0:0,0.05:2,0.1:-3")
    expected = [
        "touchdown",
        "actuator slips",
        "step of u",
        "actuator reverses",
        "body reverses",
        "actuator hits stop",
    ]
    assert re.search(".*".join(expected), output, re.DOTALL)


def test_events_at_one_time_are_each_listed_once():
    stance = hopform.solve_stance(HOPPER, v2=-1.93, u=3.0)
    down, up = stance.phases
    between = up._replace(end=up.start)
    events = (hopform.Event(up.start, "x1_slips"), hopform.Event(up.start, "x2_reverses"))
    both = copy.copy(stance)
    vars(both).update(events=events, phases=(down, between, up))
    assert tables.beginnings(both) == ["touchdown", "actuator slips", "body reverses"]


def test_the_ledger_adds_up_to_rounding(answer):
    (line,) = (line for line in answer(*DROP).splitlines() if line.startswith("difference"))
    assert all(abs(float(number)) < 1e-12 for number in line.split()[1:])


def test_a_long_table_says_how_much_it_leaves_out(answer, robot_file):
    stiff = robot_file(k="1e7", b1="0", b2="0.1", f1="0", f2="0.01")
    output = answer("stance", "--robot", stiff, "--v2", "-0.0001", "--u", "0")
    phases = strict_json(answer("stance", "--robot", stiff, "--v2", "-0.0001", "--u", "0", "--json"))["phases"]
    assert len(phases) > 60
    assert f"{len(phases) - 40} rows left out" in output


def test_json_carries_the_numbers_of_the_python_interface(answer):
    stance = hopform.solve_stance(HOPPER, v2=hopform.touchdown_velocity(HOPPER, 0.2), u=3.0)
    record = strict_json(answer(*DROP, "--json"))
    assert (record["duration"], record["apex"], record["aed"]) == (stance.duration, stance.apex, stance.aed)
    assert stance.takeoff is not None
    assert record["takeoff"] == stance.takeoff._asdict()
    assert [tuple(event.values()) for event in record["events"]] == list(stance.events)
    assert record["phases"][1]["state"] == stance.phases[1].state._asdict()


def test_initial_values_and_options_reach_the_solver(answer):
    arguments: dict = {
        "v2": -0.7,
        "x1": 0.01,
        "v1": -0.1,
        "x2": 0.39,
        "horizon": 0.1,
        "max_phases": 7,
    }
    options = [part for name, value in arguments.items() for part in (f"--{name.replace('_', '-')}", value)]
    record = strict_json(answer("stance", *options, "--u-steps", "0:1,0.05:2", "--json"))
    stance = hopform.solve_stance(HOPPER, u=[(0.0, 1.0), (0.05, 2.0)], **arguments)
    assert record["end"] == stance.end._asdict()
    assert record["u"] == [{"time": 0.0, "current": 1.0}, {"time": 0.05, "current": 2.0}]


def test_commands_take_what_a_flight_has_left_in_the_leg(answer):
    """A compression says with x1 how high the body is."""
    start = ("--v2", "-1.9", "--x1", "0.01", "--compression", "0.02")
    record = strict_json(answer("stance", *start, "--u", "3", "--json"))
    stance = hopform.solve_stance(HOPPER, v2=-1.9, x1=0.01, compression=0.02, u=3.0)
    same = hopform.solve_stance(HOPPER, v2=-1.9, x1=0.01, x2=0.39, u=3.0)
    assert record["apex"] == stance.apex == pytest.approx(same.apex)
    assert stance.compression(0.0) == 0.02 and record["start"]["x2"] == pytest.approx(0.39, abs=1e-16)
    record = strict_json(answer("control", *start, "--h-des", "0.2", "--json"))
    command = hopform.choose_current(HOPPER, v2=-1.9, x1=0.01, compression=0.02, h_des=0.2)
    assert (record["compression"], record["x2"], record["u"]) == (0.02, None, command.u)


def test_hops_are_printed_in_a_row_each(answer):
    output = answer("hop", "--height", "0.2", "--u", "3", "--hops", "3")
    assert "hopper_c: 3 hops completed" in output
    assert re.search(r"1 +0 +20 +0\.20193 +3 +188\.13 +takeoff +22\.329 +\+1\.9216", output)


def test_a_hopper_that_stays_on_the_ground_says_so(answer):
    record = strict_json(answer("hop", "--height", "0.05", "--hops", "20", "--json"))
    assert record["status"] == "stopped"
    assert record["hops"][-1]["apex"] is None and record["hops"][-1]["takeoff_time"] is None
    assert "stays on the ground" in answer("hop", "--height", "0.05", "--hops", "20")


# ---- CSV ----


def read_csv(text):
    rows = list(csv.DictReader(io.StringIO(text)))
    return {name: [float(row[name]) for row in rows] for name in rows[0]}


def test_csv_of_a_stance_has_the_documented_columns_and_the_times_of_events(answer):
    columns = read_csv(answer(*DROP, "--csv", "-", "--samples", "50"))
    stance = hopform.solve_stance(HOPPER, v2=hopform.touchdown_velocity(HOPPER, 0.2), u=3.0)
    assert list(columns) == list(SCHEMA["CSV of a stance"])
    assert columns["t"] == sorted({*columns["t"]})
    assert {0.0, stance.duration, stance.events[0].time} <= set(columns["t"])
    assert len(columns["t"]) == 51


def test_csv_of_a_stance_is_its_states_and_energies(answer):
    columns = read_csv(answer(*DROP, "--csv", "-"))
    stance = hopform.solve_stance(HOPPER, v2=hopform.touchdown_velocity(HOPPER, 0.2), u=3.0)
    assert np.array_equal(columns["x2"], stance.at(columns["t"]).x2)
    assert np.array_equal(columns["N"], HOPPER.k * stance.compression(columns["t"]))
    # Energies of some 20 J from two computations: a few last digits.
    gained = [energy - columns["E"][0] for energy in columns["E"]]
    assert gained == pytest.approx(columns["AED"], abs=1e-12)
    assert columns["AED"][-1] == pytest.approx(stance.aed, abs=1e-12)


def test_what_hop_is_asked_reaches_the_simulation(answer, tmp_path):
    ground = tmp_path / "ground.csv"
    ground.write_text("0\n0.01\n-0.01\n")
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(dataclasses.replace(HOPPER, m_s=2.9).to_toml())
    noise = {"x1": 1e-3, "v1": 2e-2, "x2": 3e-3, "v2": 1e-2, "ground": 2e-3}
    options = [part for name, value in noise.items() for part in (f"--noise-{name}", value)]
    options += ["--current-scale", 0.95, "--quantum", 0.002, "--delay", 0.001, "--model", wrong, "--seed", 7]
    arguments = ["--height", 0.2, "--terrain", ground, "--controller", "return-map", "--h-des", 0.19, *options]
    table, archive = tmp_path / "hops.csv", tmp_path / "run.npz"
    answer("hop", *arguments, "--hops-csv", table, "--npz", archive)
    errors = hopform.hopping.Errors(
        **noise, current_scale=0.95, quantum=0.002, delay=0.001, model=hopform.load_robot(wrong)
    )
    run = hopform.hopping.simulate(
        HOPPER, [0.0, 0.01, -0.01], hopform.hopping.controllers.ReturnMap(0.19), height=0.2, errors=errors, seed=7
    )
    with np.load(archive) as found:
        assert (found["table"] == run.table).all()
    assert table.read_text().count("\n") == 4
    assert table.read_text().split("\n", maxsplit=1)[0].split(",") == list(SCHEMA["Table of a run"])


def test_the_gains_of_the_return_are_those_given_or_designed_and_are_said(answer):
    arguments = ("hop", "--height", "0.2", "--u", "3", "--hops", "3")
    free, given = (strict_json(answer(*arguments, *more, "--json")) for more in ((), ("--gains", "2000,300")))
    run = hopform.hopping.simulate(HOPPER, [0.0] * 3, 3.0, height=0.2)
    assert [hop["gains"] for hop in free["hops"]] == [hop.flight.gains._asdict() for hop in run.hops]
    assert [hop["gains"] for hop in given["hops"]] == [{"Kp": 2000.0, "Kd": 300.0}] * 3
    assert given["hops"][2]["apex"] != free["hops"][2]["apex"]
    assert "gains as given: Kp = 2000 N/m, Kd = 300 N s/m." in answer(*arguments, "--gains", "2000,300")
    low, high = sorted((run.hops[1].flight.gains.Kp, run.last.gains.Kp))
    assert f"gains designed for each: Kp = {low:.4g} to {high:.4g} N/m" in answer(*arguments)


def test_the_margin_of_the_exact_controller_is_kept(answer):
    arguments = ("hop", "--height", "0.2", "--controller", "exact", "--h-des", "0.25", "--json")
    free, kept = (strict_json(answer(*arguments, *more))["hops"] for more in ((), ("--stop-margin", "0.05")))
    assert free[0]["apex"] > kept[0]["apex"] + 0.01


def test_csv_of_a_run_has_the_documented_columns_and_agrees_with_itself(answer):
    columns = read_csv(answer("hop", "--height", "0.2", "--u", "3", "--hops", "3", "--csv", "-"))
    assert list(columns) == list(SCHEMA["CSV of a run"])
    assert columns["x2"][0] == pytest.approx(0.6, abs=1e-15)
    gained = [energy - columns["E"][0] for energy in columns["E"]]
    assert gained == pytest.approx(columns["AED"], abs=1e-11)


# ---- files ----


def test_files_are_written_next_to_the_table(answer, tmp_path):
    table, picture = tmp_path / "stance.csv", tmp_path / "stance.svg"
    output = answer(*DROP, "--csv", table, "--plot", picture)
    assert f"wrote {table}" in output and f"wrote {picture}" in output
    assert sorted(tmp_path.iterdir()) == [table, picture]
    assert len(read_csv(table.read_text())["t"]) > 500


def test_with_json_only_json_is_printed(answer, tmp_path):
    strict_json(answer(*DROP, "--json", "--csv", tmp_path / "stance.csv", "--plot", tmp_path / "stance.png"))
    assert len(list(tmp_path.iterdir())) == 2


def test_a_run_is_drawn(answer, tmp_path):
    answer("hop", "--height", "0.2", "--hops", "2", "--plot", tmp_path / "run.pdf")
    assert (tmp_path / "run.pdf").read_bytes().startswith(b"%PDF-")


def test_a_file_that_was_there_is_replaced_and_keeps_its_name(answer, tmp_path):
    path, link = tmp_path / "real.csv", tmp_path / "link.csv"
    path.write_text("old")
    link.symlink_to(path)
    answer(*DROP, "--csv", link)
    assert link.is_symlink() and path.read_text().startswith("t,x1")


@pytest.mark.skipif(not Path("/dev/null").exists(), reason="needs /dev/null")
def test_a_device_stays_a_device(answer):
    answer(*DROP, "--csv", "/dev/null")
    assert Path("/dev/null").is_char_device()


# ---- bad input ----

BAD_ROBOTS = {
    "a negative mass": ({"m_s": "-1.2"}, "m_s must be > 0 kg, got -1.2"),
    "NaN": ({"b1": "nan"}, "b1 must be >= 0"),
    "a unit string": ({"k": '"12 N/cm"'}, "k must be a number in N/m, got '12 N/cm'"),
    "an unknown key": ({"L_0": "0.4"}, "'L_0', did you mean 'L0'?"),
    "a stroke upside down": ({"x1_min": "0.1"}, "x1_m"),
}
BAD_OPTIONS = {
    "a unit": (("--height", "12cm"), "'--height': takes a number in m, written without a unit, got '12cm'"),
    "NaN": (("--height", "nan"), "'--height': takes a finite number in m, got 'nan'"),
    "infinity": (("--height", "0.2", "--u", "inf"), "'--u': takes a finite number in A, got 'inf'"),
    "a drop from below": (("--height", "-0.1"), "height must be >= 0 m, got -0.1"),
    "no start": ((), "give either --height or --v2"),
    "two starts": (("--height", "0.2", "--v2", "-1"), "give either --height or --v2"),
    "two currents": (("--height", "0.2", "--u", "1", "--u-steps", "0:1"), "give either --u or --u-steps"),
    "x1 outside its stroke": (("--v2", "-1", "--x1", "0.2"), "x1 must be within its stroke"),
    "a spring that pulls": (("--v2", "-1", "--x2", "0.5"), "x2 must be <="),
    "a leg that pulls": (("--v2", "-1", "--compression", "-0.01"), "compression must be >= 0 m"),
    "a leg given twice": (("--v2", "-1", "--x2", "0.39", "--compression", "0.01"), "either x2 or compression"),
    "a step without a current": (("--v2", "-1", "--u-steps", "0:1,0.1"), "'--u-steps': takes steps t:u"),
    "steps that do not start at 0": (("--v2", "-1", "--u-steps", "0.1:1"), "u must start at t = 0"),
    "no time": (("--v2", "-1", "--horizon", "0"), "horizon must be > 0 s"),
    "no phase": (("--v2", "-1", "--max-phases", "0"), "--max-phases"),
    "one sample": (("--v2", "-1", "--samples", "1"), "--samples"),
    "an unknown precision": (("--v2", "-1", "--dtype", "float16"), "'float64', 'float32'"),
    "an unknown robot": (("--v2", "-1", "--robot", "hoper_c"), "did you mean 'hopper_c'?"),
    "a missing file": (("--v2", "-1", "--robot", "nowhere/x.toml"), "there is no file 'nowhere/x.toml'"),
    "an unknown option": (("--v2", "-1", "--hight", "1"), "--height"),
}


def refused(run, folder, *arguments):
    """The message of a command that exits with 2, prints nothing else and writes nothing."""
    before = sorted(folder.iterdir())
    code, output, errors = run(*arguments)
    assert (code, output) == (2, "")
    assert errors.startswith("hopform: ") and errors.count("\n") == 1
    assert sorted(folder.iterdir()) == before
    return errors


def with_outputs(folder):
    return "--csv", folder / "out.csv", "--plot", folder / "out.svg"


@pytest.mark.parametrize(("changes", "expected"), BAD_ROBOTS.values(), ids=BAD_ROBOTS)
def test_a_bad_robot_is_refused_by_field_and_nothing_is_written(run, tmp_path, robot_file, changes, expected):
    path = robot_file(**changes)
    message = refused(run, tmp_path, "stance", "--robot", path, "--height", "0.2", *with_outputs(tmp_path))
    assert expected in message and path.name in message


@pytest.mark.parametrize(("options", "expected"), BAD_OPTIONS.values(), ids=BAD_OPTIONS)
def test_a_bad_option_is_refused_by_name_and_nothing_is_written(run, tmp_path, options, expected):
    assert expected in refused(run, tmp_path, "stance", *options, *with_outputs(tmp_path))


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--plot", "out.jpg"), ".svg, .pdf or .png, got 'out.jpg'"),
        (("--csv", "nowhere/out.csv"), "there is no folder nowhere"),
        (("--plot", "nowhere/out.svg"), "there is no folder nowhere"),
        (("--csv", "."), "it is a folder"),
        (("--csv", "out.svg", "--plot", "out.svg"), "the same file"),
        (("--json", "--csv", "-"), "both print"),
    ],
)
def test_an_output_that_cannot_be_is_refused_before_anything_is_computed(run, tmp_path, monkeypatch, options, expected):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(hopform, "solve_stance", None)
    assert expected in refused(run, tmp_path, *DROP, *options)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("stanc",), "'stance'"),
        (("equations", "99"), "there is no equation '99'; known: (1) to (27)"),
        (
            ("equations", "fast"),
            "there is no equation 'fast'; known: (1) to (27); `hopform equations --claims fast` shows",
        ),
        (("equations", "99", "--claims"), "there is no claim '99'; `hopform equations --claims` lists them"),
        (("equations", "--claims", "--as", "c"), "--claims and --as exclude each other"),
        (("robots", "--json", "--toml"), "exclude each other"),
        (("robots", "--toml", "--c", "float32"), "exclude each other"),
        (("robots", "hoper_b"), "'hopper_b'"),
        (("hop",), "--height"),
        (("hop", "--height", "0.2", "--hops", "0"), "--hops"),
        (
            ("hop", "--height", "0.2", "--hops", "9" * 20),
            "takes a whole number <= 65536, got '99999999999999999999'",
        ),
        (
            ("stance", "--height", "0.2", "--samples", "9" * 5000),
            "takes a whole number of up to 4300 digits, got '9999",
        ),
        (("stance", "--height", "1" + "0" * 400), "takes a finite number in m, got '1000"),
        (
            ("hop", "--height", "0.2", "--terrain", "hills"),
            "there is no terrain 'hills'; known: flat, steps, uniform, gaussian",
        ),
        (("hop", "--height", "0.2", "--terrain", "hills.csv"), "hills.csv cannot be read: No such file or directory"),
        (("hop", "--height", "0.2", "--size", "-0.1", "--terrain", "gaussian"), "size must be >= 0 m"),
        (("hop", "--height", "0.2", "--controller", "exact"), "the controller exact needs --h-des"),
        (
            ("hop", "--height", "0.2", "--h-des", "0.2"),
            "--h-des goes with the controllers exact, printed and return-map",
        ),
        (("hop", "--height", "0.2", "--controller", "exact", "--h-des", "-0.1"), "h_des must not lie below the ground"),
        (
            ("hop", "--height", "0.2", "--controller", "exact", "--h-des", "0.2", "--u", "1"),
            "--u goes with the constant",
        ),
        (("hop", "--height", "0.2", "--stop-margin", "0.01"), "--stop-margin goes with the exact controller"),
        (("hop", "--height", "0.2", "--noise-v2", "-1"), "v2 must be >= 0 m/s"),
        (("hop", "--height", "0.2", "--gains", "2000"), "'--gains': takes Kp,Kd in N/m and N s/m"),
        (("hop", "--height", "0.2", "--gains", "2000,nan"), "takes a finite number in N s/m, got 'nan'"),
        (("hop", "--height", "0.2", "--gains", "2000,-1"), "Kd must be >= 0 N s/m"),
        (("hop", "--height", "0.2", "--model", "hoper_c"), "did you mean 'hopper_c'?"),
        (("hop", "--height", "0.2", "--csv", "a.csv", "--hops-csv", "a.csv"), "two outputs name the same file"),
        (("hop", "--height", "nan"), "finite number"),
    ],
)
def test_other_commands_refuse_in_one_line_too(run, tmp_path, arguments, expected):
    assert expected in refused(run, tmp_path, *arguments)


def test_a_terrain_with_a_hole_is_refused_by_file_line_and_column(run, tmp_path):
    path = tmp_path / "ground.csv"
    path.write_text("x,height\n1,0.0\n2,nan\n")
    message = refused(run, tmp_path, "hop", "--height", "0.2", "--terrain", path, "--npz", tmp_path / "run.npz")
    assert "ground.csv, line 3, column 'height': a height must be a finite number in m, got 'nan'" in message
    path.write_text("0.0\n")
    assert "has 1 heights, too few for --hops 2" in refused(
        run, tmp_path, "hop", "--height", "0.2", "--terrain", path, "--hops", "2"
    )


def test_an_old_file_survives_a_refusal(run, tmp_path):
    path = tmp_path / "out.csv"
    path.write_text("old")
    refused(run, tmp_path, "stance", "--height", "-1", "--csv", path)
    assert path.read_text() == "old"


def test_a_picture_without_matplotlib_is_refused_with_the_name_of_the_extra(tmp_path):
    without = "import sys; sys.modules['matplotlib'] = None; from hopform._front import main; sys.exit(main())"
    picture, table = str(tmp_path / "out.svg"), str(tmp_path / "out.csv")
    code, output, errors = python(without, *DROP, "--csv", table, "--plot", picture)
    assert (code, output) == (2, "")
    assert errors == f"hopform: {hopform.MissingExtra('a plot', 'plot')}\n"
    assert list(tmp_path.iterdir()) == []
    assert python(without, *DROP)[0] == 0


def test_a_current_above_the_limit_is_solved_with_a_warning(run):
    code, output, errors = run("stance", "--height", "0.2", "--u", "4", "--json")
    assert code == 0
    assert errors == "hopform: warning: u = 4.0 A is above u_max = 3.0 A\n"
    assert strict_json(output)["warnings"] == ["u = 4.0 A is above u_max = 3.0 A"]


def test_a_run_above_the_limit_warns_once(run):
    code, output, errors = run("hop", "--height", "0.2", "--u", "3.5", "--hops", "3", "--json")
    assert (code, errors.count("\n")) == (0, 1)
    assert len(strict_json(output)["warnings"]) == 1


# ---- as a program ----


def test_what_is_piped_has_no_colour_codes_and_no_broken_lines(answer):
    for arguments in (DROP, ("robots", "hopper_b"), ("equations",), ("hop", "--height", "0.2")):
        output = answer(*arguments)
        assert "\x1b" not in output and "\N{HORIZONTAL ELLIPSIS}" not in output


def test_a_closed_pipe_is_no_traceback():
    reader, writer = os.pipe()
    os.close(reader)
    code = "import sys; from hopform._front import main; sys.exit(main())"
    command = [sys.executable, "-c", code, *DROP, "--csv", "-"]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (1, "")


def test_a_person_who_waits_is_shown_that_something_happens(monkeypatch, capsys):
    monkeypatch.setattr(_progress, "BAR_AFTER", 0.0)
    monkeypatch.setenv("FORCE_COLOR", "1")
    with output.progress_bar("1000 hops"):
        time.sleep(0.3)
    assert "1000 hops" in capsys.readouterr().err


def test_nobody_is_shown_what_is_over_in_time(monkeypatch, capsys):
    monkeypatch.setenv("FORCE_COLOR", "1")
    with output.progress_bar("1000 hops"):
        pass
    assert capsys.readouterr().err == ""


def test_numbers_of_the_table_are_those_of_the_json(answer):
    record = strict_json(answer(*DROP, "--json"))
    assert f"{record['duration'] * 1000:.5g} ms" in answer(*DROP)
    entries = record["ledger"]
    assert math.isclose(record["aed"], entries["spring_work"] + entries["viscous_2"] + entries["coulomb_2"])
