"""What once came in or went out wrong, a test each: numbers, counts, files, names and streams from outside."""

import dataclasses
import multiprocessing
import os
import re
import subprocess
import sys
import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import hopform
import hopform.hopping
import hopform.identify
from derive.model.equations import ModelError
from derive.model_file import read_model
from hopform import _checks
from hopform import _front as cli
from hopform._checks import number_of, whole_of
from hopform._files import LARGEST, check_writable, printable, read_text, write
from hopform._texts import markdown
from hopform.identify._recordings import parse_recording
from hopform.identify._synthetic import MOTION, TESTS, to_csv
from tests import needs
from tests.calls import DECAY, HOPPER

HUGE = "100000000000000"


def refused(capsys, *line):
    """The message of a command line that is refused in one line."""
    assert cli.main([str(each) for each in line]) == 2
    output, errors = capsys.readouterr()
    assert output == "" and errors.startswith("hopform: ") and errors.count("\n") == 1
    return errors


# ---- counts: refused before anything is allocated ----


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (("stance", "--height", "0.2", "--samples", HUGE), "--samples"),
        (("hop", "--height", "0.2", "--hops", HUGE), "--hops"),
        (("hop", "--height", "0.2", "--hops", str(2**31 - 1)), "--hops"),
        (("hop", "--height", "0.2", "--samples", str(2**31 - 1), "--csv", "-"), "--samples"),
        (("reach", "--heights", "10000000000000"), "--heights"),
        (("reach", "--currents", "1000000000000"), "--currents"),
        (("reach", "--heights", "100000", "--currents", "100000"), "heights x currents must be at most 8388608"),
        (("record", "drop", "--repeats", "1000000000000"), "repeats"),
        (("record", "drop", "--repeats", "1000", "--rate", "20000"), "repeats must be at most"),
    ],
)
def test_a_command_refuses_a_count_before_it_allocates(capsys, line, said):
    hopform.solve_stance(HOPPER, v2=-1.0)
    tracemalloc.start()
    try:
        assert said in refused(capsys, *line)
        assert tracemalloc.get_traced_memory()[1] < 16e6
    finally:
        tracemalloc.stop()


VIEW = np.broadcast_to(-1.0, (10**7, 10**7))


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: hopform.solve_stances(HOPPER, v2=VIEW), "v2 must have at most"),
        (lambda: hopform.solve_stances(HOPPER, v2=range(10**12)), "v2 must have at most"),
        (lambda: hopform.solve_stances(HOPPER, v2=[VIEW]), "v2 must have at most"),
        (lambda: hopform.solve_stances(HOPPER, v2=VIEW[0], x1=np.zeros((10**7, 1))), "at most 16777216 stances"),
        (lambda: hopform.solve_stances(HOPPER, v2=VIEW[0, : 10**6], sensitivities=True), "stances, got shape"),
        (lambda: hopform.solve_stances(HOPPER, v2=-1.0, threads=2**31 - 1), "threads"),
        (lambda: hopform.next_apex(HOPPER, -VIEW[0], -VIEW[:, :1]), "at most"),
        (lambda: hopform.reachability(HOPPER, np.arange(1.0, 1e5), np.arange(1e5)), "heights x currents"),
        (
            lambda: hopform.hopping.simulate(HOPPER, iter(lambda: 0.0, None), height=0.2),
            "terrain must have at most 65536",
        ),
        (lambda: hopform.hopping.terrain.uniform(2**31 - 1, 0.1), "hops"),
        (lambda: hopform.solve_stance(HOPPER, v2=-1.0).grid(2**31 - 1), "count"),
        (lambda: hopform.solve_stance(HOPPER, v2=-1.0).grid(dt=1e-9), "dt must be >"),
        (lambda: hopform.solve_stance(HOPPER, v2=-1.0).at(VIEW), "t must have at most"),
        (lambda: hopform.hopping.TouchdownDetector(count=2**31 - 1), "count"),
        (lambda: hopform.hopping.TouchdownDetector().detect(np.broadcast_to(0.0, 10**9)), "samples must have at most"),
        (lambda: hopform.hopping.TouchdownDetector().simulated_delays(0.1, trials=2**31 - 1), "trials"),
        (lambda: hopform.hopping.TouchdownDetector().simulated_delays(0.1, 0.2), "trials must be at most"),
        (lambda: hopform.hopping.controllers.ReturnMap(0.2, heights=2**20, currents=2**20), "heights x currents"),
    ],
)
def test_a_call_refuses_a_count_before_it_allocates(call, said):
    tracemalloc.start()
    try:
        with pytest.raises(hopform.HopformError, match=said):
            call()
        assert tracemalloc.get_traced_memory()[1] < 300e6  # what two of them hand in
    finally:
        tracemalloc.stop()


def test_a_law_that_would_be_asked_for_ever_is_refused():
    law = hopform.hopping.controllers.Sampled(1e-300, lambda t, state: 0.0)
    with pytest.raises(hopform.HopformError, match="period must be >="):
        hopform.hopping.simulate(HOPPER, [0.0], lambda touchdown: law, height=0.2)


# ---- numbers ----


@pytest.mark.parametrize("text", ["1_0", "\N{ARABIC-INDIC DIGIT ONE}", "0x10", "1e", "1.0.0", "", "1 0", "one", "--1"])
def test_a_text_that_other_readers_take_for_no_number_is_none(text):
    assert number_of(text) is None and whole_of(text) is None


@pytest.mark.parametrize("text", ["0", "-1.5", "+.5", "2.", " 1e-3 ", "1E+5", "inf", "-Infinity", "1e400"])
def test_a_number_in_text_is_what_python_reads(text):
    assert number_of(text) == float(text)


def test_a_long_text_that_is_no_number_takes_no_time():
    assert number_of("1" * 2_000_000 + "x") is None


def test_a_cell_with_an_underscore_is_no_number(tmp_path):
    text = re.sub(r"^0\.002,\S+", "0.002,1_0", to_csv(DECAY), flags=re.MULTILINE)
    with pytest.raises(hopform.HopformError, match="line 3, column 'x2_m': must be a number, got '1_0'"):
        parse_recording(text, "a.csv").position("x2")
    heights = tmp_path / "heights.csv"
    heights.write_text("0\n1_0\n")
    with pytest.raises(hopform.HopformError, match="line 2, column 1: a height must be .* m, got '1_0'"):
        hopform.hopping.terrain.read(heights)


def test_masked_numbers_are_refused():
    masked = np.ma.array([-1.0, -2.0], mask=[False, True])
    with pytest.raises(hopform.HopformError, match="v2 must have no masked numbers"):
        hopform.solve_stances(HOPPER, v2=masked)
    assert hopform.solve_stances(HOPPER, v2=np.ma.array([-1.0])).duration.shape == (1,)


@pytest.mark.parametrize(
    "value",
    [[True], np.array([True]), ["1.0"], [1j], np.array(["2020"], "M8[Y]"), [None], [[1], []], {0.1: 0.2}, {0.1}],
)
def test_what_is_no_real_number_is_refused_in_an_array_too(value):
    with pytest.raises(hopform.HopformError, match="^v2 must be numbers in m/s, got "):
        hopform.solve_stances(HOPPER, v2=value)


def test_no_current_is_no_ampere():
    with pytest.raises(hopform.HopformError, match=r"^current must be > 0 A, got 0\.0$"):
        hopform.identify.record(HOPPER, "step", current=0.0)


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("level", [-1.9, -1.0, -0.4, 0.0, 10.0])
def test_a_level_below_the_thresholds_has_a_mean_delay(level, count):
    delay = hopform.hopping.TouchdownDetector(count=count).mean_delay(0.1, level)
    assert delay > 0.0


def test_a_quantum_that_is_finer_than_the_last_digit_rounds_nothing():
    fine, none = (hopform.identify.record(HOPPER, "drop", seed=1, quantum=quantum) for quantum in (1e-320, 0.0))
    assert np.array_equal(fine.columns["x2"].values, none.columns["x2"].values)


def test_a_recording_beyond_all_numbers_is_refused(capsys):
    assert "must" in refused(capsys, "record", "drop", "--noise", "1.7e308")
    with np.errstate(all="raise"):
        for line in (("--height", "1e300"), ("--quantum", "1e-320"), ("--quantum", "1e300")):
            code = cli.main(["record", "drop", "--duration", "0.5", *line])
            output, _ = capsys.readouterr()
            assert code in (0, 2) and "inf" not in output and "nan" not in output


@pytest.mark.parametrize("call", [hopform.solve_stances, hopform.hopping.simulate, hopform.reachability])
def test_a_progress_that_cannot_be_called_is_refused(call):
    needs = {"v2": -1.0} if call is hopform.solve_stances else {"terrain": [0.0], "height": 0.2}
    needs = {"heights": [0.1], "currents": [0.0]} if call is hopform.reachability else needs
    with pytest.raises(hopform.HopformError, match="progress must be a function, got 3"):
        call(HOPPER, **needs, progress=3)


# ---- files in ----


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("k = " + "[" * 3000 + "]" * 3000, "nested too deep"),
        ("k = " + "9" * 400, "k must lie within"),
        ("k = " + "9" * 5000, "more than 4300 digits"),
        ("x" * (2**20 + 1), "more than 1048576 bytes"),
        ("k = " + "{a=" * 200 + "1" + "}" * 200, "k must be a number in N/m"),
        ("x" * 10_000 + " = 1", "unknown parameter 'xxx"),
    ],
)
def test_a_robot_file_that_is_none_is_refused(tmp_path, capsys, content, said):
    path = tmp_path / "r.toml"
    path.write_text(content)
    assert said in refused(capsys, "robots", path)


@pytest.mark.parametrize(
    "name", ["x" * 5000, "x" * 5000 + ".toml", "a/b\0c", "nowhere/x.toml", "/dev/zero", "/", "\udc80"]
)
def test_a_name_that_no_robot_has_is_refused(capsys, name):
    assert len(refused(capsys, "stance", "--height", "0.2", "--robot", name)) < 700


def test_files_with_a_byte_order_mark_are_read(tmp_path):
    robot, recording, heights = (tmp_path / name for name in ("r.toml", "r.csv", "h.csv"))
    for path, text in ((robot, HOPPER.to_toml()), (recording, to_csv(DECAY)), (heights, "height\n0.5\n")):
        path.write_text(text, "utf-8-sig")
    assert hopform.load_robot(robot) == HOPPER
    assert hopform.identify.read_recording(recording).time.size == DECAY.time.size
    assert hopform.hopping.terrain.read(heights) == (0.5,)


def test_a_long_field_is_no_csv(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time_s,x2_m\n0," + "1" * 131073)
    for read in (hopform.identify.read_recording, hopform.hopping.terrain.read):
        with pytest.raises(hopform.HopformError, match="is not a CSV: field larger than field limit"):
            read(path)


def test_lines_are_counted_as_an_editor_counts_them(tmp_path):
    path = tmp_path / "h.csv"
    path.write_text('height,what\n0,"two\nlines"\n0,a\x0bb\nx,c\n')
    with pytest.raises(hopform.HopformError, match="line 5, column 'height': a height must be"):
        hopform.hopping.terrain.read(path)


def test_what_is_read_is_a_regular_file_of_a_limited_size(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "large").write_bytes(b"0" * (LARGEST + 1))
    for name, said in (("pipe", "not a regular file"), ("large", "more than"), (".", "folder|directory|regular")):
        with pytest.raises(hopform.HopformError, match=said):
            read_text(tmp_path / name)


def test_a_model_file_with_a_long_number_is_refused_in_a_short_message(tmp_path):
    path = tmp_path / "model.py"
    path.write_text(f"from hopform.model import *\nforce(include('hopper').x2, {'9' * 500}, 'push')\n")
    with pytest.raises(ModelError, match="a number must be 0 or between") as caught:
        read_model(path)
    assert len(str(caught.value)) < 500


# ---- files out ----


def test_a_file_that_is_replaced_keeps_its_mode(tmp_path):
    path, new = tmp_path / "a.csv", tmp_path / "b.csv"
    path.write_text("old")
    path.chmod(0o600)
    umask = os.umask(0o027)
    try:
        write({path: b"new", new: b"new"})
    finally:
        os.umask(umask)
    assert (path.stat().st_mode & 0o777, new.stat().st_mode & 0o777) == (0o600, 0o640)


def test_a_name_of_252_characters_is_written(tmp_path):
    path = tmp_path / ("x" * 248 + ".csv")
    assert cli.main(["stance", "--height", "0.2", "--csv", str(path)]) == 0
    assert path.read_text().startswith("t,x1")


def test_all_files_are_written_or_none(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "old").write_text("old")
    with pytest.raises(hopform.HopformError, match="cannot be written"):
        write({tmp_path / "old": b"new", tmp_path / "nowhere" / "x": b"new"})
    assert (tmp_path / "old").read_text() == "old"
    assert {path.name for path in tmp_path.iterdir()} == {"folder", "old"}


@pytest.mark.parametrize("path", ["/dev/null/x", "nowhere/x", "x" * 256, "", ".", "dangling"])
def test_what_cannot_be_written_is_known_before(tmp_path, monkeypatch, path):
    monkeypatch.chdir(tmp_path)
    Path("dangling").symlink_to("nowhere/at_all")
    with pytest.raises(hopform.HopformError, match="cannot be written"):
        check_writable(Path(path))


def test_a_pipe_that_nobody_reads_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(hopform.HopformError, match="cannot be written"):
        write({tmp_path / "pipe": b"new"})


@pytest.mark.parametrize("method", ["to_csv", "to_npz"])
@pytest.mark.parametrize("path", ["nowhere/x", "/dev/null/x", 3, "a\0b", b"x"])
def test_a_run_is_saved_by_the_same_rule(tmp_path, monkeypatch, method, path):
    monkeypatch.chdir(tmp_path)
    run = hopform.hopping.simulate(HOPPER, [0.0], height=0.2)
    with pytest.raises(hopform.HopformError, match="cannot be written|path must be a path"):
        getattr(run, method)(path)


@pytest.mark.parametrize("folder", ["/dev/null/x", "x" * 256, "file", "file/x", "full"])
def test_a_folder_that_cannot_be_made_is_known_before(tmp_path, monkeypatch, capsys, folder):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("hopform._export.package", None)
    Path("file").write_text("old")
    Path("full").mkdir()
    (Path("full") / "README.md").mkdir()
    assert re.search("cannot be|must be new or empty", refused(capsys, "export", folder))


@pytest.mark.parametrize(
    "prefix", ["x" * 300, "x" * 32, "X", "1x", "a-b", "", "_", "\N{LATIN SMALL LETTER E WITH ACUTE}"]
)
def test_a_prefix_that_no_name_can_have_is_refused(tmp_path, capsys, prefix):
    assert "--prefix must be" in refused(capsys, "export", tmp_path / "new", "--prefix", prefix)
    assert list(tmp_path.iterdir()) == []


def test_an_export_that_fails_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr("hopform._export.package", lambda wanted: {Path("a/b"): "", Path("x" * 256): ""})
    with pytest.raises(hopform.HopformError, match="cannot be written"):
        hopform._export.export(tmp_path / "made" / "deeper", hopform._export.Wanted())
    assert list(tmp_path.iterdir()) == []


# ---- text ----


def test_no_name_from_outside_commands_a_terminal(tmp_path, capsys):
    evil = "\x1b]0;owned\x07\x1b[31m\u202e"
    path = tmp_path / "r.toml"
    path.write_text(hopform.Robot(m_eff=1.0, m_s=1.0, k=1e3, L0=0.4, name=evil, description=evil).to_toml())
    for line in (
        ("robots", path),
        ("stance", "--height", "0.1", "--robot", path),
        ("hop", "--height", "0.1", "--robot", path),
    ):
        assert cli.main([*map(str, line)]) == 0
        output, _ = capsys.readouterr()
        assert printable(output.replace("\n", "")) == output.replace("\n", "")
    assert "\x1b" not in refused(capsys, "stance", "--height", "0.2", "--robot", evil)


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("a|b<c>", r"a\|b\<c\>"),
        ("![x](y)", r"!\[x\](y)"),
        ("x1_min", "x1_min"),
        ("_x_ *y* `z` $u$", r"\_x\_ \*y\* \`z\` \$u\$"),
        ("<script>&amp;", r"\<script\>\&amp;"),
        ("two\nlines\x1b", r"two lines\\x1b"),
    ],
)
def test_a_text_in_markdown_is_shown_as_it_is(text, written):
    assert markdown(text) == written


# ---- streams and processes ----


def process(*line, **how):
    return subprocess.run([sys.executable, "-m", "hopform", *line], stderr=subprocess.PIPE, check=False, **how)


def test_a_full_or_closed_output_is_no_traceback():
    with open("/dev/full", "wb") as full:
        done = process("robots", stdout=full)
    assert (done.returncode, done.stderr) == (1, b"hopform: cannot go on: No space left on device\n")
    closed = subprocess.run(f"{sys.executable} -m hopform robots >&-", shell=True, stderr=subprocess.PIPE, check=False)
    assert b"Traceback" not in closed.stderr


def duration(v2):
    return hopform.solve_stance(HOPPER, v2=v2).duration


@pytest.mark.parametrize("method", needs.the_first(["fork", "spawn"]))
def test_other_processes_solve_alike(method):
    speeds = [-1.0, -1.5, -1.9]
    with multiprocessing.get_context(method).Pool(2) as pool:
        assert pool.map(duration, speeds) == [duration(v2) for v2 in speeds]


def test_threads_refuse_and_solve_side_by_side():
    def both(n):
        with pytest.raises(hopform.HopformError, match=f"^v2 must be finite m/s, got {'nan' if n % 2 else 'inf'}$"):
            hopform.solve_stance(HOPPER, v2=float("nan" if n % 2 else "inf"))
        return duration(-1.0 - n / 200.0)

    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(both, range(200))) == [duration(-1.0 - n / 200.0) for n in range(200)]


def test_lists_in_a_list_are_counted_before_an_array_is_made_of_them(monkeypatch):
    monkeypatch.setattr(_checks, "MEMORY", 8 * 5)
    assert _checks.array_of("x", [[1.0, 2.0], [3.0, 4.0]], "m").shape == (2, 2)
    with pytest.raises(hopform.HopformError, match="x must have at most 5 numbers, got 6"):
        _checks.array_of("x", [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], "m")


# ---- names and laws ----


def test_dir_lists_what_is_public_and_nothing_else():
    assert dir(hopform) == sorted(hopform.__all__)


@pytest.mark.parametrize("u", [lambda t, state: 3.0, hopform.hopping.controllers.Sampled(1e-3, lambda t, state: 3.0)])
def test_a_law_in_place_of_a_current_is_told_where_laws_go(u):
    with pytest.raises(hopform.HopformError, match=r"^u must be a number in A or steps .* controllers\.Sampled"):
        hopform.solve_stance(HOPPER, v2=-1.0, u=u)
    with pytest.raises(hopform.HopformError, match=r"^hop 0: u must be .* controllers\.Sampled"):
        hopform.hopping.simulate(HOPPER, [0.0], lambda _: lambda t, state: 3.0, height=0.2)
    with pytest.raises(hopform.HopformError, match="^u must be "):
        hopform.solve_stances(HOPPER, v2=-1.0, u=u)


def test_a_field_in_capitals_is_asked_for_in_small_letters():
    text = HOPPER.to_toml().replace("b1 = 150.0", "B1 = 150")
    with pytest.raises(hopform.HopformError, match="unknown parameter 'B1', did you mean 'b1'"):
        hopform._robots.robot_from_toml(text, "mine.toml")


@pytest.mark.parametrize("make", [hopform.Robot, partial(dataclasses.replace, HOPPER)], ids=["made", "replaced"])
def test_an_unknown_parameter_of_a_robot_is_told_with_the_nearest_one_and_all(make):
    """By another case each, and far from all."""
    names = [field.name for field in hopform.Robot.all_fields()]
    for name in names:
        with pytest.raises(hopform.HopformError) as caught:
            make(**{name.swapcase(): 1.0})
        known = f"did you mean {name!r}? Known: {', '.join(names)}"
        assert str(caught.value) == f"unknown parameter {name.swapcase()!r}, {known}"
    with pytest.raises(hopform.HopformError, match=rf"^unknown parameter 'QQQQ'; known: {', '.join(names)}$"):
        make(QQQQ=1.0)


ARRAYS = [np.array([1.0, 2.0]), np.ma.array([1.0, 2.0], mask=[True, False]), np.ma.masked, [1, 2], 0, False, ""]


@pytest.mark.parametrize("test", [*TESTS, MOTION])
@pytest.mark.parametrize("start", ARRAYS, ids=repr)
def test_a_start_that_is_no_mapping_is_refused_by_every_test(start, test):
    with pytest.raises(hopform.HopformError, match=r"^start must be a mapping of names to values, got "):
        hopform.identify.record(HOPPER, test, start=start)


def test_a_name_that_dir_lists_can_be_read():
    """Of every result; what was not asked for is None."""
    stance = hopform.solve_stance(HOPPER, v2=-1.9)
    run = hopform.hopping.simulate(HOPPER, [0.0], 2.0, height=0.2)
    batches = [
        hopform.solve_stances(HOPPER, v2=[-1.0, -2.0], events=flag, sensitivities=flag) for flag in (False, True)
    ]
    command = hopform.choose_current(HOPPER, v2=-1.9, h_des=0.2)
    reach = hopform.reachability(HOPPER, heights=[0.1, 0.2], currents=[0.0, 1.0])
    for result in (HOPPER, stance, stance.fly(), stance.sensitivities, run, run.hops[0], *batches, command, reach):
        for name in dir(result):
            getattr(result, name)
    assert batches[0].event_words is None and batches[1].event_words.shape == batches[1].event_kind.shape


def test_a_controller_warns_of_a_body_that_rises_at_touchdown(capsys):
    up, down = (hopform.choose_current(HOPPER, v2=v2, h_des=0.2) for v2 in (1.9, -1.9))
    stance = hopform.solve_stance(HOPPER, v2=1.9, u=up.u)
    assert up.warnings == stance.warnings == ("the body moves up at touchdown, v2 = 1.9 m/s",) and down.warnings == ()
    assert up.warnings[0] in repr(up)
    compressed = hopform.choose_current(HOPPER, v2=1.9, x2=0.3, h_des=0.2)
    assert compressed.warnings == ()
    assert cli.main(["control", "--v2", "1.9", "--h-des", "0.2"]) == 0
    assert "the body moves up at touchdown" in capsys.readouterr().err
