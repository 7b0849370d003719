"""No command overwrites what it reads, and no two of its outputs are one file: refused before anything is computed."""

import html
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote_to_bytes

import pytest

import hopform
from hopform import _front as cli
from hopform._texts import markdown
from tests import needs

ROBOT = hopform.load_robot("hopper_c").to_toml()


class Files(NamedTuple):
    """What a command needs beside files, the options that it reads a file by, and those that it writes one by."""

    arguments: tuple[str, ...]
    reads: tuple[str, ...]
    writes: dict[str, str]
    """option: a suffix that it takes"""


COMMANDS = {
    "robots": Files((), ("name",), {}),
    "stance": Files(("--height", "0.2"), ("--robot",), {"--csv": ".svg", "--plot": ".svg"}),
    "motion": Files((), ("--robot",), {"--csv": ".svg", "--plot": ".svg"}),
    "control": Files(("--height", "0.2", "--h-des", "0.2"), ("--robot", "--from-fit"), {"--plot": ".svg"}),
    "reach": Files(("--heights", "2", "--currents", "2"), ("--robot", "--from-fit"), {"--plot": ".svg"}),
    "hop": Files(
        ("--height", "0.2"),
        ("--robot", "--from-fit", "--model", "--terrain"),
        {"--csv": ".svg", "--hops-csv": ".svg", "--npz": ".svg", "--plot": ".svg"},
    ),
    "identify": Files(("all",), ("files", "--robot"), {"--out": ".svg", "--report": ".md", "--plot": ".svg"}),
    "fit": Files((), ("files",), {"--out": ".svg", "--report": ".md", "--plot": ".svg"}),
    "record": Files(("drop",), ("--robot",), {"--csv": ".csv"}),
    "export": Files((), ("--robot",), {"folder": ""}),
    "model check": Files((), ("model",), {}),
    "model build": Files((), ("model", "--out"), {}),
    "model prove": Files((), ("model",), {}),
    "model show": Files((), ("model",), {}),
    "reference write": Files((), (), {"folder": ""}),
}
"""Every command that reads or writes files. The folder of `export` is empty."""
CLASHES = [
    (command, read, write)
    for command, files in COMMANDS.items()
    for read in files.reads
    for write in files.writes
    if "folder" not in files.writes
]
PAIRS = [
    (command, first, second)
    for command, files in COMMANDS.items()
    for first in files.writes
    for second in files.writes
    if first < second
]


def same(folder, path):
    return path


def with_a_dot(folder, path):
    return f".{os.sep}{path.name}"


def by_a_detour(folder, path):
    return folder / ".." / folder.name / path.name


def by_a_link(folder, path):
    link = folder / f"link{path.suffix}"
    link.symlink_to(path)
    return link


def by_a_second_name(folder, path):
    other = folder / f"second{path.suffix}"
    other.hardlink_to(path)
    return other


SPELLINGS = [same, with_a_dot, by_a_detour, by_a_link, by_a_second_name]


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys):
    """The message of a command that is refused before it reads anything, and leaves the folder as it was."""

    def no_work(*_, **__):
        raise AssertionError("work has begun")

    def call(*arguments):
        monkeypatch.chdir(tmp_path)
        for name in ("load_robot", "solve_stance", "solve_motion", "choose_current", "reachability"):
            monkeypatch.setattr(hopform, name, no_work)
        monkeypatch.setattr("hopform.hopping._commands.simulate", no_work)
        for module in ("_commands", "_fit_command"):
            monkeypatch.setattr(f"hopform.identify.{module}.read_recording", no_work)
        before = content(tmp_path)
        assert cli.main([str(argument) for argument in arguments]) == 2
        output, errors = capsys.readouterr()
        assert output == "" and errors.startswith("hopform: ") and errors.count("\n") == 1
        assert content(tmp_path) == before
        return errors

    return call


def content(folder):
    return {path: path.read_bytes() if path.is_file() else b"" for path in folder.rglob("*")}


def reading(command, read, path):
    """The arguments with which a file is read, by that option or beside it."""
    role = "" if command == "fit" else "drop:"
    recordings = [f"{role}{path if read == 'files' else 'recording'}"] if "files" in COMMANDS[command].reads else []
    return [*recordings, *([read, path] if read.startswith("--") else [])]


def test_every_option_that_names_a_file_is_in_the_table():
    for name, command in cli.commands().items():
        found = {
            parameter.opts[0]
            for parameter in command.params
            if any(word in (parameter.metavar or "") for word in ("FILE", "DIR"))
        }
        files = COMMANDS.get(name, Files((), (), {}))
        assert found == {*files.reads, *files.writes}, name


@pytest.mark.parametrize("spelling", SPELLINGS)
@pytest.mark.parametrize(("command", "read", "write"), CLASHES)
def test_no_output_overwrites_an_input(tmp_path, refused, command, read, write, spelling):
    arguments, _, writes = COMMANDS[command]
    own = tmp_path / f"mine{writes[write]}"
    own.write_text(ROBOT)
    message = refused(command, *arguments, *reading(command, read, own), write, spelling(tmp_path, own))
    assert "would overwrite" in message and write in message and own.name in message


@pytest.mark.parametrize("spelling", SPELLINGS)
@pytest.mark.parametrize(("command", "first", "second"), PAIRS)
def test_no_two_outputs_are_one_file(tmp_path, refused, command, first, second, spelling):
    arguments, _, writes = COMMANDS[command]
    own = tmp_path / f"mine{writes[first]}"
    own.write_text("old")
    other = spelling(tmp_path, own)
    if writes[first] != writes[second]:  # a name that the other option takes, of the same file
        other = tmp_path / f"other{writes[second]}"
        other.symlink_to(own)
    message = refused(command, *arguments, *reading(command, "", ""), first, own, second, other)
    assert "two outputs name the same file" in message and first in message and second in message


@pytest.mark.parametrize("option", ["--plot", "--out"])
def test_the_picture_beside_a_report_is_an_output_too(tmp_path, refused, option):
    message = refused("identify", "drop", "drop.csv", "--report", "r.md", option, "r.svg")
    assert all(said in message for said in ("two outputs", "the picture of --report r.svg", f"{option} r.svg"))


def test_the_picture_beside_a_report_does_not_overwrite_an_input(tmp_path, refused):
    (tmp_path / "r.svg").write_text("time_s,x2_m\n")
    assert "the picture of --report r.svg would overwrite" in refused("identify", "drop", "r.svg", "--report", "r.md")


def test_two_outputs_that_are_not_there_yet_are_compared(tmp_path, refused):
    (tmp_path / "a.csv").symlink_to(tmp_path / "b.csv")
    message = refused("hop", "--height", "0.2", "--csv", "a.csv", "--hops-csv", "b.csv")
    assert "two outputs name the same file" in message


def test_a_shipped_robot_is_no_file(tmp_path, monkeypatch):
    """`hopper_c` is the shipped one even where a file has its name, which may be written then."""
    monkeypatch.chdir(tmp_path)
    Path("hopper_c").write_text("old")
    assert cli.main(["stance", "--robot", "hopper_c", "--height", "0.2", "--csv", "hopper_c"]) == 0
    assert Path("hopper_c").read_text().startswith("t,x1")


LATIN_1 = os.fsdecode("Rück$.csv".encode("latin-1"))


@pytest.mark.parametrize(
    "name", needs.the_first(["a$b_$.csv", r"$\frac$.csv", 'the "big" one.csv', "a|b<c>.csv", LATIN_1])
)
def test_files_of_any_name_are_reported(tmp_path, monkeypatch, name):
    """Names that mean something to matplotlib, TOML, HTML, or nothing in UTF-8."""
    monkeypatch.chdir(tmp_path)
    assert cli.main(["record", "decay", "--height", "0.04", "--duration", "1", "--seed", "3", "--csv", name]) == 0
    out, before = name.removesuffix(".csv"), Path(name).read_bytes()
    outputs = ("--out", f"{out}.toml", "--report", f"{out}.md", "--plot", f"{out}.png")
    assert cli.main(["identify", "all", f"decay:{name}", "--known", "m_s=3", *outputs]) == 0
    assert cli.main(["identify", "all", f"decay:{name}", "--known", "m_s=3", "--report", "page.html"]) == 0
    shown = out.encode("utf-8", "backslashreplace").decode()
    assert hopform.load_robot(f"{out}.toml").name == shown
    assert Path(name).read_bytes() == before
    page = Path(f"{out}.md").read_text("utf-8")
    assert f"| {markdown(shown)}.csv |" in page and shown in re.sub(r"\\([^a-z])", r"\1", page)
    (link,) = re.findall(r"!\[the fit\]\((\S+)\)", page)
    assert Path(os.fsdecode(unquote_to_bytes(link))).is_file()
    assert html.escape(shown) in Path("page.html").read_text("utf-8")
    assert {path.name for path in tmp_path.iterdir()} == {
        "page.html", *(f"{out}{suffix}" for suffix in (".csv", ".toml", ".md", ".svg", ".png"))
    }  # fmt: skip


def test_a_name_that_the_output_cannot_show_is_escaped(tmp_path):
    command = [sys.executable, "-m", "hopform", "stance", "--height", "0.2", "--csv", LATIN_1]
    strict = os.environ | {"PYTHONIOENCODING": "utf-8:strict"}
    done = subprocess.run(command, cwd=tmp_path, env=strict, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert rb"wrote R\udcfcck$.csv" in done.stdout


def test_a_link_to_itself_is_written_like_a_new_file(tmp_path):
    loop = tmp_path / "loop.csv"
    loop.symlink_to(loop)
    assert cli.main(["stance", "--height", "0.2", "--csv", str(loop)]) == 0
    assert loop.read_text().startswith("t,x1")


def test_a_name_that_is_too_long_is_refused(tmp_path, refused):
    assert "cannot be written" in refused("stance", "--height", "0.2", "--csv", "x" * 300)
