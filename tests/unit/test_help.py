"""The help of the commands, and the message where an extra is missing: what is written there works."""

import importlib.metadata
import json
import os
import shlex
import shutil
import subprocess
import sys

import pytest

import hopform
from hopform import _front as cli
from tests.derived import SHIPPED, built

EXAMPLES = {name: command.examples for name, command in cli.commands().items()}
OPTIONS = [(group, option) for command in cli.commands().values() for group, options in command.options.items()
           for option in options]  # fmt: skip


def test_every_command_has_two_examples():
    assert EXAMPLES.keys() == cli.COMMANDS.keys()
    assert all(len(lines) == 2 for lines in EXAMPLES.values())
    assert all(f"{line} ".startswith(f"{command} ") for command, lines in EXAMPLES.items() for line in lines)


@pytest.mark.sliced
def test_the_examples_of_the_help_run(tmp_path, monkeypatch, capsys, store):
    """A model is copied, its solver taken from those that the tests have built."""
    pytest.importorskip("matplotlib")
    pytest.importorskip("scipy")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    shutil.copy(SHIPPED / "leg_damper.py", "mine.py")
    solvers = {name: built(store, SHIPPED / f"{name}.py") for name in ("leg_damper", "joint")}
    monkeypatch.setattr("hopform._building.make", lambda model, folder, bar, in_cache: shutil.copytree(
        solvers["joint" if model == "joint" else "leg_damper"], folder))  # fmt: skip
    capsys.readouterr()
    for command in sorted(EXAMPLES, key=lambda name: name != "record"):
        assert cli.main([*command.split(), "--help"]) == 0
        shown = capsys.readouterr().out
        for line in EXAMPLES[command]:
            assert f"\n  hopform {line}\n" in shown
            assert cli.main(shlex.split(line)) == 0, line
            assert capsys.readouterr().out, line
    assert {"drop.csv", "mine.toml", "firmware", "single", "stance.csv"} <= {path.name for path in tmp_path.iterdir()}


GROUPS = ["", *cli.GROUPS]
WORDS = [*GROUPS, *cli.COMMANDS]


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_every_help_fits_the_terminal(capsys, monkeypatch, columns):
    """Only the examples, which are to be pasted, may be longer."""
    monkeypatch.setenv("COLUMNS", str(columns))
    for words in WORDS:
        assert cli.main([*words.split(), "--help"]) == 0
        text = capsys.readouterr().out.partition("Examples:")[0]
        assert all(len(line) <= columns for line in text.splitlines()), words


@pytest.mark.parametrize("columns", [60, 80, 120])
@pytest.mark.parametrize("group", GROUPS)
def test_the_summary_of_a_command_is_a_whole_sentence(capsys, monkeypatch, group, columns):
    """On one line, but where the terminal is narrower than usual."""
    monkeypatch.setenv("COLUMNS", str(columns))
    assert cli.main([*group.split(), "--help"]) == 0
    listed = capsys.readouterr().out.partition("Commands:\n")[2]
    assert "..." not in listed
    if columns >= 80:
        of = [words.removeprefix(group).split()[0] for words in cli.COMMANDS if words.startswith(group)]
        assert [line.split()[0] for line in listed.splitlines()] == list(dict.fromkeys(of))
        assert all(line.endswith(".") for line in listed.splitlines())


@pytest.mark.parametrize("words", WORDS)
def test_help_is_a_word_too(capsys, words):
    """`hopform help model list` and `hopform model help list` are `hopform model list --help`."""
    assert cli.main([*words.split(), "--help"]) == 0
    shown = capsys.readouterr().out
    *group, command = words.split() or [""]
    for line in (["help", *words.split()], [*group, "help", *command.split()]):
        assert cli.main(line) == 0
        assert capsys.readouterr().out == shown


def test_help_with_what_is_no_command_is_refused(capsys):
    assert cli.main(["help", "stanze"]) == 2
    assert capsys.readouterr().err == "hopform: No such command 'stanze'. Did you mean 'stance'?\n"


@pytest.mark.parametrize("given", ["--solver joint", "--solver=joint"])
@pytest.mark.parametrize("words", ["motion", "model list"])
def test_a_solver_behind_the_command_is_refused_with_its_place(capsys, words, given):
    assert cli.main([*words.split(), *given.split()]) == 2
    said = f"hopform: --solver stands before the command: hopform --solver DIR|NAME {words}\n"
    assert capsys.readouterr().err == said


def test_no_name_of_an_argument_is_in_brackets_twice(capsys):
    """The usage has an argument that may be left out in [], one that has to be given in {}."""
    for words in cli.COMMANDS:
        assert cli.main([*words.split(), "--help"]) == 0
        usage = capsys.readouterr().out.splitlines()[0]
        assert not any(twice in usage for twice in ("[[", "]]", "{{", "}}")), usage


def test_options_stand_under_what_they_are_about(capsys):
    assert cli.main(["hop", "--help"]) == 0
    parts = capsys.readouterr().out.split("\n\n")
    sections = {part.splitlines()[0].rstrip(":"): part for part in parts if part.splitlines()[0].endswith(":")}
    for group, option in (
        ("Robot and start", "--height"), ("Ground", "--terrain"), ("Current", "--h-des"), ("Solver", "--horizon"),
        ("Errors of sensors and motor", "--delay"), ("Output", "--plot"), ("Options", "--help"),
    ):  # fmt: skip
        assert [name for name, part in sections.items() if f"  {option} " in part or f", {option} " in part] == [group]


@pytest.mark.parametrize(
    ("words", "place", "offered"), [("hopform st", 1, {"stance"}), ("hopform stance --he", 2, {"--height", "--help"})]
)
def test_a_shell_completes_commands_and_options(words, place, offered):
    """As the script of `--show-completion bash` asks, of commands whose modules are loaded when they are called."""
    asked = {"_HOPFORM_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(place)}
    done = subprocess.run(
        [sys.executable, "-m", "hopform"], env=os.environ | asked, capture_output=True, text=True, check=True
    )
    assert set(done.stdout.split()) == offered


def test_every_group_is_that_of_some_option():
    names = {f"{name}.{option}" for name, command in COMMANDS.items() for option in command}
    for group, option in OPTIONS:
        assert any(each == option or each.endswith(f".{option}") for each in names), (group, option)


COMMANDS = {name: {str(parameter.name) for parameter in each.params} for name, each in cli.commands().items()}


class Installed:
    """A distribution as pip has recorded it."""

    def __init__(self, record):
        self.record = record

    def read_text(self, name):
        assert name == "direct_url.json"
        return None if self.record is None else json.dumps(self.record)


@pytest.mark.parametrize(
    ("record", "wanted"),
    [
        (None, ["hopform[plot]"]),
        ({"url": "file:///home/a%20b/h", "dir_info": {"editable": True}}, ["--editable", "/home/a b/h[plot]"]),
        ({"url": "file:///tmp/hopform.whl", "archive_info": {}}, ["hopform[plot] @ file:///tmp/hopform.whl"]),
    ],
    ids=["index", "checkout", "file"],
)
def test_a_missing_extra_is_added_to_the_installation_at_hand(monkeypatch, record, wanted):
    monkeypatch.setattr(importlib.metadata, "distribution", lambda name: Installed(record))
    message = str(hopform.MissingExtra("a plot", "plot"))
    said, _, command = message.partition(": ")
    assert said == "a plot needs the extra `plot`"
    assert shlex.split(command) == [sys.executable, "-m", "pip", "install", *wanted]
