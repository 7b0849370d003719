"""The README is true: its Python runs, its paths exist, its commands are the ones that exist."""

import doctest
import re
import shlex
from pathlib import Path

from hopform import _cli as cli
from hopform._cli import main
from tests.bench.hopping import misses

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text("utf-8")


def test_the_ten_lines_run():
    outcome = doctest.testfile(str(ROOT / "README.md"), module_relative=False)
    assert outcome.attempted >= 7
    assert outcome.failed == 0


def test_the_page_on_hopping_runs_and_its_table_is_what_the_benchmark_prints():
    outcome = doctest.testfile(str(ROOT / "docs" / "how-to" / "hop-over-terrain.md"), module_relative=False)
    assert outcome.attempted >= 9
    assert outcome.failed == 0
    page = (ROOT / "docs" / "how-to" / "hop-over-terrain.md").read_text("utf-8")
    rows = misses()
    assert [row for row in rows if not row.startswith("| exact") and row not in page] == []


def test_the_page_on_identification_runs_from_recordings_to_a_controller():
    outcome = doctest.testfile(str(ROOT / "docs" / "tutorials" / "identification.md"), module_relative=False)
    assert outcome.attempted >= 9
    assert outcome.failed == 0


def test_the_commands_on_identification_run_in_their_order(tmp_path, monkeypatch):
    page = (ROOT / "docs" / "tutorials" / "identification.md").read_text("utf-8")
    blocks = re.findall(r"```sh\n(.*?)```", page, re.DOTALL)
    commands = [shlex.split(line) for block in blocks for line in block.splitlines()]
    assert len(commands) >= 12
    monkeypatch.chdir(tmp_path)
    assert [command for command in commands if main(command[1:]) != 0] == []
    assert {path.name for path in tmp_path.iterdir()} >= {"mine.toml", "mine.html"}
    assert main(["control", "--robot", "mine.toml", "--height", "0.2", "--h-des", "0.2"]) == 0


def test_every_path_that_it_links_exists():
    links = re.findall(r"\]\(([^)#:]+)", README)
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_every_folder_of_the_tree_exists():
    tree = (ROOT / "CONTRIBUTING.md").read_text("utf-8").split("## The tree")[1].split("```")[1]
    folders = re.findall(r"^(\w+)/", tree, re.MULTILINE)
    assert folders
    assert [folder for folder in folders if not (ROOT / folder).is_dir()] == []


def test_every_hopform_command_of_the_page_on_commands_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # one of them writes a recording, the next one reads it
    page = (ROOT / "docs" / "reference" / "commands.md").read_text("utf-8")
    lines = [line.split("#")[0].split()[1:] for line in page.splitlines() if line.startswith("hopform ")]
    assert len(lines) == 10
    for arguments in lines:
        assert cli.main(arguments) == 0, arguments


def test_every_make_target_in_it_exists():
    makefile = (ROOT / "Makefile").read_text("utf-8")
    for target in set(re.findall(r"`make ([\w-]+)`|^make ([\w-]+)", README, re.MULTILINE)):
        assert re.search(rf"^{''.join(target)}:", makefile, re.MULTILINE), target
