"""The identity: the paper's hopper, built as a stranger under another name, answers every command with the bytes of the
hopper that ships, but for its name.
"""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

import pytest

from hopform import _front as cli
from hopform._cli.options import EXAMPLES
from hopform._export import SYSTEMS
from tests import needs
from tests.derived import built

pytestmark = needs.library

HANDFUL = (
    "robots", "robots hopper_b --json", "robots ideal --set k=900 --toml", "robots --c float32", "equations 14",
    "stance --height 0.2 --u 3 --json", "stance --v2 -1.9 --u-steps 0:0,0.05:2 --sensitivities --csv a.csv --plot a.svg",
    "stance --height 0.2 --dtype float32 --json",
    "hop --height 0.2 --terrain uniform --size 0.01 --hops 3 --controller exact --h-des 0.2 --json --npz a.npz",
    "hop --height 0.2 --hops 3 --u 3 --csv a.csv --hops-csv b.csv --plot a.png",
    "control --height 0.2 --h-des 0.2 --printed", "control --v2 -1.9 --h-des 0.15 --json --plot a.svg",
    "reach --heights 5 --currents 4 --json", "reach --heights 4 --currents 3", "record drop --seed 1 --csv drop.csv",
    "identify check drop.csv --known m_s=3",
    "export firmware --f32 --prefix leg", "selftest --json", "stance --height 0.2 --robot absent", "hop --height -1",
)  # fmt: skip
"""Commands that are run in their order in one folder; the last two are refused."""
MANY = (
    *(line for lines in EXAMPLES.values() for line in lines if not line.startswith(("model", "record ramp"))),
    "record ramp --plan --seed 3",
    *(f"export for_{system} --for {system} --robot hopper_c" for system in SYSTEMS),
    *(f"record {kind} --seed 2 --csv {kind}.csv" for kind in ("free", "decay", "step", "air", "ramp")),
    "identify all step.csv decay.csv --known m_s=3 --known m_eff=25 --report report.html --json",
    "record drop --seed 1 --csv drop.csv", "identify drop drop.csv --known m_s=3 --out mine.toml --json",
    "control --from-fit mine.toml --draws 20 --height 0.2 --h-des 0.2",
    "hop --height 0.2 --controller return-map --h-des 0.2 --json", "reach --json --plot reach.pdf",
)  # fmt: skip


@dataclass(frozen=True)
class Said:
    """What a command did: its exit code, both streams, and what it left in its folder."""

    code: int
    out: str
    errors: str
    files: dict[str, bytes]


def said(folder: Path, line: str, capsys: pytest.CaptureFixture[str], *front: str) -> Said:
    capsys.readouterr()
    code = cli.main([*front, *shlex.split(line)])
    out, errors = capsys.readouterr()
    files = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    return Said(code, re.sub(r'"seconds": [0-9.e-]+', '"seconds": 0', out), errors, files)  # of computing


def compare(lines: tuple[str, ...], solver: Path, folder: Path, capsys, monkeypatch) -> None:
    """Each of the lines by the hopper and by the stranger, each in a folder of its own."""
    for line in lines:
        both = []
        for name, front in (("hopper", ()), ("stranger", ("--solver", str(solver)))):
            own = folder / name / "of_commands"
            own.mkdir(parents=True, exist_ok=True)
            monkeypatch.chdir(own)
            both.append(said(own, line, capsys, *front))
        hopper, stranger = both
        assert hopper.code in (0, 2), hopper
        assert hopper.files.keys() == stranger.files.keys(), line
        differing = [name for name, content in hopper.files.items() if content != stranger.files[name]]
        assert not differing, (line, differing)
        ours = (hopper.code, hopper.out, hopper.errors)
        theirs = (stranger.code, *(text.replace("stranger", "hopper") for text in (stranger.out, stranger.errors)))
        assert ours == theirs, line
        assert hopper.out or hopper.errors, line


@pytest.mark.sliced
def test_the_hopper_built_as_a_stranger_answers_with_the_same_bytes(store, tmp_path, capsys, monkeypatch):
    pytest.importorskip("matplotlib")
    pytest.importorskip("scipy")
    compare(HANDFUL, built(store, "stranger"), tmp_path, capsys, monkeypatch)


@pytest.mark.nightly
def test_the_stranger_draws_and_exports_the_same_bytes(store, tmp_path, capsys, monkeypatch):
    pytest.importorskip("matplotlib")
    pytest.importorskip("scipy")
    compare(MANY, built(store, "stranger"), tmp_path, capsys, monkeypatch)


@pytest.mark.sliced
def test_it_is_the_strangers_solver_that_answers(store, tmp_path, capsys):
    """What the comparison would not see if --solver were passed over: a refusal names the model."""
    mine = tmp_path / "mine.toml"
    mine.write_text('model = "hopper"\nm_eff = 1.0\n')
    line = f"stance --v2 -1 --robot {mine}"
    done = said(tmp_path, line, capsys, "--solver", str(built(store, "stranger")))
    assert done.code == 2 and "of the model 'hopper', the solver is that of 'stranger'" in done.errors
