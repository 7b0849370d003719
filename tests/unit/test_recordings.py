"""Recordings are read in SI units, what they show by themselves is seen, and bad ones are refused with file,
line and column.
"""

import dataclasses
import math
from itertools import product

import numpy as np
import pytest

import hopform
from hopform._front import main
from hopform.identify._drop import fit_drop_test
from hopform.identify._force import fit_force
from hopform.identify._held import HELD
from hopform.identify._joint import fit_robot
from hopform.identify._kinds import problem_of
from hopform.identify._recordings import (
    COLUMNS,
    Column,
    Recording,
    noise_of,
    outliers,
    parse_recording,
    quantum_of,
    read_recording,
    saturated,
)
from hopform.identify._synthetic import record, to_csv
from tests import needs

HOPPER = hopform.load_robot("hopper_c")


def test_noise_and_quantum_are_seen():
    x = record(HOPPER, "decay", height=0.04, noise=3e-4, quantum=0.0, seed=1).position("x2")
    assert noise_of(x) == pytest.approx(3e-4, rel=0.15)
    still = record(HOPPER, "decay", height=0.04, noise=0.0, quantum=1.0 / 56000.0, rate=200.0).position("x2")
    assert quantum_of(still) == pytest.approx(1.0 / 56000.0, rel=1e-6)
    assert quantum_of(x) == 0.0


@pytest.mark.parametrize(("b2", "f2"), [(0.0, 0.5), (6.0, 0.0), (3.0, 0.3)])
def test_a_decay_shows_its_frequency_and_which_friction_it_has(b2, f2):
    robot = dataclasses.replace(HOPPER, b2=b2, f2=f2)
    recording = record(robot, "decay", height=0.04, noise=1e-5, quantum=0.0, duration=3.0)
    start = problem_of({HELD["decay"]: recording}, {"m_s": 3.0}).starts[0]
    assert math.sqrt(start["k"] / 3.0) == pytest.approx(20.0, rel=0.02)
    assert start["b2"] == pytest.approx(b2, abs=0.45)
    assert start["f2"] == pytest.approx(f2, abs=0.08)


# ---- bad data ----


def rows(*lines: str, head: str = "time_s,x2_m") -> str:
    return "\n".join([head, *lines])


GOOD = [f"{0.005 * n},{0.02 * math.cos(35 * 0.005 * n) * math.exp(-0.01 * n)}" for n in range(200)]
BAD = {
    "an unknown unit": (rows(*GOOD, head="time_s,x2_parsec"), ("line 1", "x2_parsec", "_mm")),
    "no unit": (rows(*GOOD, head="time_s,x2"), ("line 1", "'x2'")),
    "no names": (rows(*GOOD[1:], head=GOOD[0]), ("line 1", "name the columns")),
    "millimeters called meters": (
        rows(*(f"{0.005 * n},{25.0 * math.cos(0.2 * n)}" for n in range(200))), ("line 2", "x2_m", "unit"),
    ),
    "milliseconds called seconds": (
        rows(*(f"{5 * n},{0.02 * math.cos(0.2 * n)}" for n in range(200))), ("time_s", "unit"),
    ),
    "milliseconds called seconds, at 2 kHz and more": (
        rows(*(f"{0.5 * n},{0.02 * math.cos(0.02 * n)}" for n in range(2000))), ("line 2", "x2_m", "unit of time"),
    ),
    "no units at all": (rows(*GOOD, head="Time,Height"), ("line 1", "'Time_s,Height_m'")),
    "a unit that is none": (rows(*GOOD, head="t [s],x2 [furlong]"), ("line 1", "x2 [furlong]", "x2_m")),
    "swapped columns": (rows(*(",".join(reversed(line.split(","))) for line in GOOD)), ("line", "time_s", "swapped")),
    "a constant signal": (rows(*(f"{0.005 * n},0.1" for n in range(200))), ("x2_m", "constant")),
    "too short": (rows(*GOOD[:12]), ("12 samples",)),
    "infinity": (rows(*GOOD[:50], "0.25,inf", *GOOD[51:]), ("line 52", "x2_m", "finite")),
    "hardly a number": (rows(*GOOD[:15], *(f"{0.005 * n},nan" for n in range(15, 200))),
                        ("line 17", "185 of 200 samples without a number in x2_m", "at least 20")),
    "a word": (rows(*GOOD[:50], "0.25,oops", *GOOD[51:]), ("line 52", "x2_m", "oops")),
    "a missing cell": (rows(*GOOD[:50], "0.25", *GOOD[51:]), ("line 52", "1 columns")),
    "time going backwards": (rows(*GOOD[:50], "0.2,0.0", *GOOD[51:]), ("line 52", "time_s", "goes back")),
    "time standing still": (rows(*GOOD[:50], GOOD[49], *GOOD[51:]),
                            ("line 52", "time_s", "stands still", "more digits", "all but one sample of a time")),
    "no release": (rows(*(f"{0.005 * n},{0.1 * (n / 200) ** 2}" for n in range(200))), ("line", "release")),
    "no position": (rows(*GOOD, head="time_s,force_N"), ("line 1", "position", "force_N")),
    "a position in ampere": (rows(*GOOD, head="time_s,x2_A"), ("line 1", "x2_A", "current")),
    "nothing at all": ("", ("empty",)),
    "meters called millimeters": (rows(*(f"{0.005 * n},{0.02 * math.cos(0.2 * n)}" for n in range(200)),
                                       head="time_s,x2_mm"),
                                  ("line 2", "x2_mm", "unit")),
    "seconds called milliseconds": (rows(*GOOD, head="time_ms,x2_m"), ("line 3", "time_ms", "unit")),
    "a decimal comma between commas": (rows(*GOOD).replace(".", ","), ("line 2", "columns", "names 2")),
    "two columns of one name": (rows(*(f"{line},0.1" for line in GOOD), head="time_s,x2_m,x2_mm"),
                                ("line 1", "x2_mm", "x2 too")),
    "a decay that grows": (
        rows(*(f"{0.005 * n},{0.02 * math.cos(0.175 * n) * math.exp(0.01 * (n - 200))}" for n in range(200))),
        ("line", "x2_m", "release"),
    ),
    "a decay that ends before it turns back": (
        "\n".join(to_csv(record(HOPPER, "decay", seed=5)).splitlines()[:31]), ("line 31", "x2_m", "too short"),
    ),
    "noise alone": (
        rows(*(f"{0.005 * n},{x}" for n, x in enumerate(1e-4 * np.random.default_rng(1).standard_normal(200)))),
        ("x2_m", "noise"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_data_are_one_clear_message_and_nothing_is_written(name, tmp_path, capsys):
    text, words = BAD[name]
    file, out = tmp_path / "bad.csv", tmp_path / "robot.toml"
    file.write_text(text, "utf-8")
    assert main(["identify", "all", f"decay:{file}", "--out", str(out)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    for word in ("bad.csv", *words):
        assert word in said.err
    assert not out.exists()


def slow(factor: float) -> list[str]:
    """The good decay, its time slower by a factor."""
    return [f"{factor * float(t)},{x}" for t, x in (line.split(",") for line in GOOD)]


def lengths(factor: float, head: str) -> str:
    return rows(*(f"{t},{factor * float(x)}" for t, x in (line.split(",") for line in GOOD)), head=head)


NEAREST = {
    "an unknown unit": rows(*(f"{line},9" for line in GOOD), head="time_s,x2_m,way_parsec"),
    "no unit": rows(*(f"{line},9" for line in GOOD), head="time_s,x2_m,height"),
    "no names": rows(*(f"{line},9" for line in GOOD), head="time_s,x2_m,3"),
    "millimeters called meters": lengths(9.9 / 0.04, "time_s,x2_m").replace("x2_m", "x2_cm"),
    "milliseconds called seconds": rows(*slow(50.0)),
    "milliseconds called seconds, at 2 kHz and more": rows(*slow(10.0)),
    "no units at all": rows(*(f"{line},9" for line in GOOD), head="Time_s,Height_m,Current"),
    "a unit that is none": rows(*(f"{line},9" for line in GOOD), head="t [s],x2 [m],way [furlong]"),
    "swapped columns": rows(*(",".join(reversed(line.split(","))) for line in GOOD), head="x2_m,time_s"),
    "a constant signal": rows(*(f"{line},0.1" for line in GOOD), head="time_s,x2_m,x1_m"),
    "too short": rows(*GOOD[:100]),
    "infinity": rows(*(f"{line},inf" for line in GOOD), head="time_s,x2_m,limit_m"),
    "hardly a number": rows(*(f"{line},nan" for line in GOOD), head="time_s,x2_m,current_A"),
    "a word": rows(*(f"{line},RUN" for line in GOOD), head="time_s,x2_m,current_A"),
    "a missing cell": rows(*GOOD[:50], "0.25,", *GOOD[51:]),
    "time going backwards": rows(*GOOD[:50], *GOOD[51:]),
    "time standing still": rows(*GOOD[:50], GOOD[49].replace(",", "1,"), *GOOD[50:]),
    "no release": rows(*GOOD),
    "no position": rows(*(f"{line},1" for line in GOOD), head="time_s,x2_m,force_N"),
    "a position in ampere": rows(*(f"{line},1" for line in GOOD), head="time_s,x2_m,x1_A"),
    "nothing at all": rows(*GOOD).replace("\n", "\n\n"),
    "meters called millimeters": lengths(1e3, "time_s,x2_mm"),
    "seconds called milliseconds": rows(*slow(1e3), head="time_ms,x2_m"),
    "a decimal comma between commas": rows(*(line.replace(",", ";").replace(".", ",") for line in GOOD),
                                           head="time_s;x2_m"),
    "two columns of one name": rows(*(f"{line},1,2" for line in GOOD), head="time_s,x2_m,load,load"),
    "a decay that grows": rows(*slow(2.0)),
    "a decay that ends before it turns back": rows(*GOOD[:60]),
    "noise alone": lengths(0.02, "time_s,x2_m"),
}  # fmt: skip
"""For each refusal of `BAD` a file that differs in what is asked about, or has the same where no fit looks."""


def test_every_refusal_has_its_nearest_good_file():
    assert NEAREST.keys() == BAD.keys()


@pytest.mark.parametrize("name", needs.the_first([*NEAREST], 4))
def test_the_good_file_nearest_to_a_refusal_is_let_through(name):
    made = parse_recording(NEAREST[name], "good.csv")
    fit = fit_robot(decays=made, known={"m_s": 1.0}, compare=False, holdout=False, diagnose=False)
    assert fit.traces[0].tests.rms < 0.01 * float(np.std(fit.traces[0].measured))


LEFT_OUT = ("RUN", "True", "2026-05-01T12:00:03.25Z", "", "nan", "1.5")
"""What stands in columns that no fit uses."""


@pytest.mark.parametrize("separator", [",", ";", "\t", "|"])
def test_a_log_reads_alike_however_it_is_written(separator):
    """Separator, decimal comma, `sep=`, unused columns of any content, an end that is empty, units that loggers write."""
    plain = parse_recording(rows(*GOOD), "log.csv")
    heads = [("time_s", "x2_m"), ("t (s)", "x2 [m]"), ("Time (s)", "Height (m)")]
    for head, comma, told, end in product(heads, (False, True), (False, True), ("", separator)):
        if comma and separator == ",":
            continue
        for other in LEFT_OUT:
            lines = [separator.join(["state", *head, "current_A"]) + end]
            for line in GOOD:
                numbers = line.replace(",", separator).replace(".", "," if comma else ".")
                lines.append(f"{other}{separator}{numbers}{separator}{other}{end}")
            text = "\n".join([f"sep={separator}"] * told + lines)
            read = parse_recording(text, "log.csv")
            assert np.array_equal(read.position("x2"), plain.position("x2")), text[:200]
            assert np.array_equal(read.time, plain.time)


def test_time_in_nanoseconds_and_an_angle_with_the_sign_of_degrees_are_read():
    lines = [f"{1e9 * float(t):.0f},{math.degrees(float(x))!r}" for t, x in (line.split(",") for line in GOOD)]
    for head in ("time_ns,q_\N{DEGREE SIGN}", "time [ns],q (\N{DEGREE SIGN})", "time,q\nns,\N{DEGREE SIGN}"):
        read = parse_recording(rows(*lines, head=head), "log.csv")
        assert read.columns["q"].quantity == "angle"
        assert read.columns["q"].values.tolist() == pytest.approx([float(line.split(",")[1]) for line in GOOD])
        assert read.time.tolist() == pytest.approx([float(line.split(",")[0]) for line in GOOD])


def test_samples_without_a_number_are_left_out_and_said():
    """An error behind them names the line of the file all the same."""
    lines = [line if n % 9 != 5 else f"{line.split(',')[0]},{'nan' if n % 2 else ''}" for n, line in enumerate(GOOD)]
    made = parse_recording(rows(*lines), "log.csv")
    used = made.whole("x2")
    assert used.time.tolist() == [made.time[n] for n in range(200) if n % 9 != 5]
    assert used.notes[-1] == "22 of 200 samples without a number in x2_m, so left out, the first in line 7"
    assert used.line_of(5) == 8
    assert made.whole("u") is made


def test_a_column_that_cannot_be_read_is_refused_where_a_fit_asks_for_it():
    made = parse_recording(rows(*(f"{line},RUN" for line in GOOD), head="time_s,x2_m,current"), "log.csv")
    assert made.position("x2").size == 200
    with pytest.raises(hopform.HopformError, match="line 1, column 3: 'current' has no known unit"):
        made.current()


def test_a_recording_that_is_too_long_says_how_to_make_it_shorter():
    t = np.arange(140_000) / 1e4
    columns = {"x1": Column("x1_m", "length", 2, np.sin(t)), "current": Column("current_A", "current", 3, np.cos(t))}
    with pytest.raises(hopform.HopformError, match="keep every 3rd sample, or cut it"):
        fit_robot(steps=Recording("long.csv", t, columns), known={"m_eff": 25.0})


def test_a_servo_under_a_random_binary_target_is_no_pair_of_swapped_columns():
    """Its position jumps from sample to sample, and its supply is smooth."""
    target, x, count = np.repeat(np.random.default_rng(0).choice([-0.5, 0.5], 20), 10), np.zeros(200), math.tau / 4096.0
    for n in range(1, 200):
        x[n] = x[n - 1] + 0.7 * (target[n] - x[n - 1])
    x = count * np.round(x / count)
    lines = [f"{0.02 * n},{each},{7.3 + 0.01 * math.sin(0.1 * n)}" for n, each in enumerate(x.tolist())]
    made = parse_recording(rows(*lines, head="time_s,position_rad,input_V"), "servo.csv")
    assert np.array_equal(made.position("x1"), x)


@pytest.mark.parametrize("broken", ["µx2_m".encode("latin1"), "x2_m\n0,1\n".encode("utf-16")], ids=["latin1", "utf16"])
def test_a_file_that_is_no_text_is_refused_with_its_line(broken, tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"time_s,x1_m\n" + broken)
    with pytest.raises(hopform.HopformError, match=r"a\.csv, line 2: is not text in UTF-8"):
        read_recording(path)


HEADS = ['"Time (s)","Height (m)"', "t [s], x2 [m]", "time,x2\ns,m", "# rig 3, new motor\ntime,height\n[s],[m]"]


@pytest.mark.parametrize("head", HEADS)
def test_headers_of_other_loggers_are_read(head):
    read = parse_recording(rows(*GOOD[:60], "# a pause", *GOOD[60:], head=head), "log.csv")
    plain = parse_recording(rows(*GOOD), "log.csv")
    assert np.array_equal(read.position("x2"), plain.position("x2"))
    assert np.array_equal(read.time, plain.time)
    assert "a pause" in read.remarks


@pytest.mark.parametrize("last", ["0.9995", "0.9995,", "0.9995,-"])
def test_a_last_line_that_is_cut_short_is_left_out_and_said(last):
    read = parse_recording(rows(*GOOD, last), "log.csv")
    assert np.array_equal(read.time, parse_recording(rows(*GOOD), "log.csv").time)
    assert "line 202 is cut short, so left out" in read.notes


def test_a_motion_that_identifies_no_friction_is_refused_in_force():
    """One way at a growing speed: the sign of v is the constant force."""
    step = record(HOPPER, "step", seed=1)
    rising = np.linspace(0.0, 0.5, step.time.size) ** 2
    one_way = dataclasses.replace(step, columns={**step.columns, "x1": step.columns["x1"]._replace(values=rising)})
    with pytest.raises(
        hopform.HopformError, match=r"line 2, column 'x1_m': does not distinguish F, load: move both ways"
    ):
        fit_force("slide", one_way, fitted=["m", "b", "F", "load"], known={"k_f": 65.0})


def refused(path, kind, *options, capsys) -> str:
    """What is said of a file of a kind that is refused: one line, and nothing written."""
    ask = {
        "free": ("identify", "drop", "--free", str(path)),
        "drop": ("identify", "drop", str(path)),
        "force": ("--solver", "slide", "fit", str(path), "--in-force", "--fitted", "m,b,F,load"),
    }.get(kind, ("identify", "all", f"{kind}:{path}"))
    out, report = path.with_name("mine.toml"), path.with_name("report.html")
    capsys.readouterr()
    assert main([*ask, *options, "--out", str(out), "--report", str(report)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert sorted(each.name for each in path.parent.iterdir()) == [path.name]
    return said.err


@pytest.mark.parametrize("word", ["decay", "force", "anything"])
def test_what_cannot_be_identified_is_refused_with_what_can(word, capsys):
    assert main(["identify", word, "log.csv"]) == 2
    said = capsys.readouterr().err
    assert (
        said.startswith(f"hopform: identify takes drop, all or check, got '{word}'; decays,") and said.count("\n") == 1
    )


def with_column(recording, name, values) -> str:
    """A recording as CSV, a column replaced."""
    column = recording.columns[name]._replace(values=np.asarray(values))
    return to_csv(dataclasses.replace(recording, columns={**recording.columns, name: column}))


@pytest.mark.nightly
def test_a_fit_that_misses_is_refused(tmp_path, capsys):
    """Heights in m that are called cm: a free actuator hides it from the check by g, the fit does not."""
    path = tmp_path / "free.csv"
    path.write_text(to_csv(record(HOPPER, "free", seed=4, duration=1.0)).replace("x2_m", "x2_cm", 1))
    said = refused(path, "free", "--known", "m_eff=25", "--known", "gamma2=-65", capsys=capsys)
    assert "a fit needs 96 %" in said
    assert "is the unit of" in said
    assert "x2_cm" in said


@pytest.mark.parametrize("kind", needs.the_first(["step", "air", "force"], 2))
@pytest.mark.parametrize("other", needs.the_first(["of another run", "of a sine", "backwards"]))
def test_a_current_that_is_of_another_run_is_refused_by_file_line_and_column(kind, other, tmp_path, capsys):
    made = record(HOPPER, "step" if kind == "step" else "air", seed=2)
    u = made.current()
    currents = {
        "of another run": 3.0 * np.repeat(np.random.default_rng(0).choice([-1.0, 1.0], 26), 40)[: u.size],
        "of a sine": 2.0 * np.sin(9.0 * made.time),
        "backwards": u[::-1],
    }
    path = tmp_path / "mixed.csv"
    path.write_text(with_column(made, "current", currents[other]))
    known = "k_f=65" if kind == "force" else "m_eff=25"
    said = refused(path, kind, "--known", known, capsys=capsys)
    if other == "of another run" and kind == "step":  # a delay explains just enough of it
        assert "mixed.csv: the fit misses the recording by 13 % of its motion: it is of another rig" in said
        return
    assert "mixed.csv, line " in said
    assert f"column '{'current_A' if kind == 'force' else 'x1_m'}': the fit explains" in said
    assert "x1_m and current_A from the same run, each in its column" in said


def test_a_current_of_the_other_sign_is_named_as_one(tmp_path, capsys):
    """Where the force constant is known: of one of two files, and of neither where none fits with the other sign."""
    made = record(HOPPER, "air", noise=1e-6, quantum=0.0, seed=2)
    path, good = tmp_path / "turned" / "air.csv", tmp_path / "good.csv"
    path.parent.mkdir()
    path.write_text(with_column(made, "current", -made.current()))
    good.write_text(to_csv(record(HOPPER, "air", noise=1e-6, quantum=0.0, seed=3)))
    for more in ((), (str(good),)):
        said = refused(path, "force", "--known", "k_f=65", *more, capsys=capsys)
        assert f"{path}, line " in said and "column 'current_A': the fit explains" in said
        assert f"the other sign of current_A of {path} brings rms" in said
        assert said.endswith("turn it there, or in what is known of the drive\n")
    path.write_text(with_column(made, "current", made.current()[::-1]))
    assert "the other sign" not in refused(path, "force", "--known", "k_f=65", capsys=capsys)


@pytest.mark.parametrize("kind", needs.the_first(["force", "step"]))
def test_recordings_of_two_rigs_are_refused_with_the_values_of_each(kind, tmp_path, capsys):
    """A recording alone shows its rig; both together show neither, and which file is off most is chance."""
    test, known, name = ("air", "k_f=65", "m") if kind == "force" else ("step", "m_eff=25", "k")
    path, other = tmp_path / "files" / "one.csv", tmp_path / "other.csv"
    path.parent.mkdir()
    more = {"m_eff": 100.0} if kind == "force" else {"k": 2400.0}
    how = {"noise": 1e-6, "quantum": 0.0}
    path.write_text(to_csv(record(HOPPER, test, seed=2, **how)))
    other.write_text(to_csv(record(dataclasses.replace(HOPPER, **more), test, seed=3, **how)))
    said = refused(path, kind, "--known", known, str(other) if kind == "force" else f"step:{other}", capsys=capsys)
    values = said.partition(f"of each recording alone {name} is ")[2].split()[:2]
    truth = [getattr(HOPPER, next(iter(more))), *more.values()]
    assert [float(each.rstrip(",")) for each in values] == [pytest.approx(each, rel=0.02) for each in truth]


SCALED = {
    "drop": ("x2", 1000.0, "reaches 600.429 m; a position is within 10 m"),
    "decay": ("x2", 100.0, "moves over 7.3 m; at most 3 m is allowed of a body on its spring"),
    "step": ("x1", 1000.0, "within 10 m"),
    "air": ("x1", 1e-4, "0.5 mm to 10 m"),
    "free": ("current", 1e-3, "reaches 0.003 A; a drive reaches 0.01 to 300 A"),
}


@pytest.mark.parametrize("test", SCALED)
def test_a_column_in_another_unit_than_its_name_is_refused_with_what_is_allowed(test, tmp_path, capsys):
    column, factor, words = SCALED[test]
    seed, height = (1, 0.2) if test == "drop" else (4, 0.04 if test == "decay" else 0.2)
    made = record(HOPPER, test, seed=seed, height=height)
    path = tmp_path / "scaled.csv"
    path.write_text(with_column(made, column, factor * made.columns[column].values))
    said = refused(path, test, capsys=capsys)
    assert f"scaled.csv, line {said.partition('line ')[2].partition(',')[0]}, column '{column}_" in said
    assert words in said
    assert "is its unit right?" in said


def test_velocities_in_place_of_positions_are_refused(tmp_path, capsys):
    made = record(HOPPER, "step", noise=2e-5, seed=2)
    path = tmp_path / "velocity.csv"
    path.write_text(with_column(made, "x1", np.gradient(made.position("x1"), made.time)))
    assert "is the unit of x1_m right" in refused(path, "step", "--known", "m_eff=25", capsys=capsys)


@pytest.mark.sliced
def test_no_robot_is_written_of_a_fit_that_is_off(tmp_path, capsys):
    """A tenth to a fifth of the motion is missed: it is shown, with a warning."""
    made = record(HOPPER, "step", seed=2)
    path, out = tmp_path / "bent.csv", tmp_path / "mine.toml"
    x1 = made.position("x1")
    path.write_text(with_column(made, "x1", x1 + 0.07 * np.ptp(x1) * np.sin(10.0 * made.time)))
    known = ["--known", "m_eff=25"]
    assert main(["identify", "all", str(path), *known]) == 0
    assert "misses the recording" in capsys.readouterr().err
    assert main(["identify", "all", str(path), *known, "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert "misses the recording" in said
    assert "no robot is written" in said
    assert not out.exists()


def test_good_data_pass_the_same_way(tmp_path, capsys):
    file, out = tmp_path / "good.csv", tmp_path / "robot.toml"
    file.write_text(rows(*GOOD), "utf-8")
    assert main(["identify", "all", f"decay:{file}", "--known", "m_s=1", "--out", str(out)]) == 0
    assert hopform.load_robot(out).k == pytest.approx(35.0**2, rel=0.02)


def test_a_position_and_a_current_that_are_swapped_are_refused(tmp_path, capsys):
    path = tmp_path / "swapped.csv"
    path.write_text(to_csv(record(HOPPER, "step", seed=2)).replace("x1_m,current_A", "current_A,x1_m", 1))
    said = refused(path, "step", "--known", "m_eff=25", capsys=capsys)
    assert "x1_m and current_A from the same run, each in its column" in said


def dropped(change) -> str:
    """A good drop, then changed row by row."""
    lines = to_csv(record(HOPPER, "drop", seed=1)).splitlines()
    return "\n".join([lines[0], *(change(*map(float, line.split(","))) for line in lines[1:])])


BAD_DROPS = {
    "centimeters called meters": (lambda t, x: f"{t},{10.0 * x}", ("line", "x2_m", "falls with 9", "unit")),
    "time in ticks of 10 ms called seconds": (lambda t, x: f"{100.0 * t / 4.0},{x}", ("line", "x2_m", "falls with")),
    "a height that is a depth": (lambda t, x: f"{t},{-x}", ("line", "x2_m")),
    "backwards": (lambda t, x: f"{t},{0.38 + 0.1 * t * math.cos(20.0 * t)}", ("line", "x2_m", "release")),
}


@pytest.mark.parametrize("name", BAD_DROPS)
def test_a_drop_that_cannot_be_one_is_refused(name):
    change, words = BAD_DROPS[name]
    with pytest.raises(hopform.HopformError) as refused:
        fit_drop_test(parse_recording(dropped(change), "bad.csv"))
    assert all(word in str(refused.value) for word in ("bad.csv", *words))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("current_A", "current_mA"), "column 'current_mA': reaches 0.000855 A"),
        (lambda text: "\n".join(line.rpartition(",")[0] + (",current_A" if n == 0 else ",0.5")
                                for n, line in enumerate(text.splitlines())), "column 'current_A': is constant at 0.5"),
        (lambda text: text.replace(",current_A", ",tension_N"), "line 1: no column is a current"),
    ],
)  # fmt: skip
def test_a_current_that_cannot_be_one_is_refused(change, words):
    text = change(to_csv(record(HOPPER, "step", seed=2)))
    with pytest.raises(hopform.HopformError, match=words):
        fit_robot(steps=parse_recording(text, "bad.csv"), known={"m_eff": 25.0})


def test_a_current_at_its_limit_and_outliers_are_seen():
    step = record(HOPPER, "step", noise=1e-4, seed=3)
    u = np.clip(step.current() + 0.05 * np.random.default_rng(1).standard_normal(step.time.size), -0.6, 0.6)
    assert saturated(u) is not None
    assert saturated(np.sin(np.linspace(0.0, 9.0, 500))) is None
    x = step.position("x1").copy()
    broken = np.arange(7, x.size, 97)
    x[broken] += 0.05
    assert np.flatnonzero(outliers(x)).tolist() == broken.tolist()


@pytest.mark.parametrize(
    ("known", "words"),
    [
        ({"mass": 3.0}, "unknown parameter"),
        ({"m_s": 0.0}, "> 0 kg"),
        ({"b2": -1.0}, ">= 0"),
        ({"k": math.nan}, "finite"),
    ],
)
def test_known_values_are_checked(known, words):
    with pytest.raises(hopform.HopformError, match=words):
        fit_drop_test(record(HOPPER, "drop", seed=1), known=known)


def test_a_recording_reads_back_as_it_was_made(tmp_path):
    made = record(HOPPER, "step", seed=4)
    file = tmp_path / "step.csv"
    file.write_text(to_csv(made), "utf-8")
    again = read_recording(file)
    assert np.abs(again.time - made.time).max() <= 1e-9
    assert np.abs(again.position("x1") - made.position("x1")).max() <= 1e-9
    assert np.abs(again.current() - made.current()).max() <= 1e-9


@pytest.mark.parametrize("unit", [*COLUMNS, "4096perrev", "2.5permm", "10perdeg"])
def test_a_column_in_each_unit_reads_back_as_the_quantity_that_was_written(unit):
    """Written as number times 1/unit by this table alone, which repeats none of the product's."""
    in_si = {
        "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "m": 1.0, "cm": 0.01, "mm": 1e-3, "um": 1e-6, "rad": 1.0, "mrad": 1e-3,
        "deg": math.tau / 360.0, "rev": math.tau, "A": 1.0, "mA": 1e-3, "V": 1.0, "mV": 1e-3, "N": 1.0, "kN": 1e3,
        "Nm": 1.0, "mNm": 1e-3, "4096perrev": math.tau / 4096.0, "2.5permm": 1e-3 / 2.5, "10perdeg": math.tau / 3600.0,
    }  # fmt: skip
    si = 0.02 * np.arange(1, 31)
    of_time = unit in ("s", "ms", "us", "ns")
    first, title = (f"t_{unit}", "x2_m") if of_time else ("t_s", f"x2_{unit}")
    lines = [f"{(t / in_si[unit] if of_time else t)!r},{(t if of_time else t / in_si[unit])!r}" for t in si.tolist()]
    made = parse_recording(rows(*lines, head=f"{first},{title}"), "unit.csv")
    assert made.columns["x2"].values.tolist() == pytest.approx(si.tolist(), rel=1e-12)
    assert made.time.tolist() == pytest.approx((si - si[0]).tolist(), abs=1e-12)


def test_a_column_that_no_fit_uses_needs_no_unit():
    """A unit that a fit could use must be known all the same: see `BAD`."""
    made = parse_recording(rows(*(f"{each},7,1" for each in GOOD), head="time_s,x2_m,load,torque_on"), "servo.csv")
    assert list(made.columns) == ["x2"]
    assert made.notes == ("without a known unit, so left out: 'load', 'torque_on'",)
    assert not made.has_current()


def changed(made, name, of):
    """A recording with one column changed, read again from its text."""
    column = made.columns[name]
    columns = {**made.columns, name: column._replace(values=of(column.values))}
    return parse_recording(to_csv(dataclasses.replace(made, columns=columns)), "changed.csv")


def test_a_position_that_is_cut_off_is_noted_and_one_that_rests_is_not():
    made = record(HOPPER, "step", seed=1, quantum=0.0)
    notes = changed(made, "x1", lambda x: np.minimum(x, 0.8 * x.max())).notes
    assert any(each.startswith("x1_m stays at its limit from sample ") for each in notes)
    assert not parse_recording(to_csv(record(HOPPER, "step", seed=1, noise=2e-6)), "still.csv").notes


def test_a_height_that_counts_downwards_is_asked_about():
    down = changed(record(HOPPER, "drop", seed=1), "x2", np.negative)
    with pytest.raises(hopform.HopformError, match=r"column 'x2_m': .* it rises: is it a height, upwards\?"):
        fit_drop_test(down)


def test_a_fall_in_much_noise_is_no_other_gravity():
    """Its few samples alone show another acceleration; the fit shows what the noise leaves."""
    made = record(HOPPER, "drop", seed=3, noise=6e-3)
    fit = fit_drop_test(made, known={"m_s": 3.0}, compare=False, holdout=False, diagnose=False)
    assert fit["k"].low <= 1200.0 <= fit["k"].high
