"""What the workflows of .github do: a release has the sdist, the wheels and the page to play with as its assets."""

import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
WORKFLOWS = {path.stem: yaml.safe_load(path.read_text("utf-8")) for path in (ROOT / ".github/workflows").glob("*.yml")}
JOBS: dict[str, dict[str, Any]] = WORKFLOWS["release"]["jobs"]
MAKEFILE = (ROOT / "Makefile").read_text("utf-8")


def steps(job: dict[str, Any], action: str) -> list[dict[str, Any]]:
    """The steps of a job that use an action, each by its inputs."""
    return [step.get("with", {}) for step in job["steps"] if step.get("uses", "").startswith(f"{action}@")]


def lines(job: dict[str, Any]) -> list[str]:
    return [step["run"] for step in job["steps"] if "run" in step]


def before(name: str) -> Iterator[str]:
    """The jobs that have to pass before another begins."""
    asked = JOBS[name].get("needs", [])
    for needed in [asked] if isinstance(asked, str) else asked:
        yield from (needed, *before(needed))


def test_every_action_has_one_version_in_all_workflows():
    jobs = [job for workflow in WORKFLOWS.values() for job in workflow["jobs"].values()]
    used = {step["uses"] for job in jobs for step in job["steps"] if "uses" in step}
    assert all(re.fullmatch(r"actions/[a-z-]+@v\d+", each) for each in used)
    assert len({each.partition("@")[0] for each in used}) == len(used) > 4


def test_every_target_that_a_workflow_makes_is_in_the_makefile():
    made = {
        target
        for workflow in WORKFLOWS.values()
        for job in workflow["jobs"].values()
        for line in lines(job)
        for target in re.findall(r"\bmake ([\w-]+)", line)
    }
    assert {"wheels", "docs", "play", "nightly"} <= made
    assert [target for target in made if not re.search(rf"^{target}:", MAKEFILE, re.MULTILINE)] == []


def test_a_release_is_drafted_of_what_was_tested_attested_and_tried():
    assert set(before("release")) == set(JOBS) - {"release"} == {"test", "build", "try", "try-musl"}
    (attested,) = steps(JOBS["build"], "actions/attest-build-provenance")
    kept = {each["name"]: each["path"] for each in steps(JOBS["build"], "actions/upload-artifact")}
    assert kept == {"dist": "dist", "play": "out/play", "site": "out/site"}
    assert attested["subject-path"].split() == ["dist/*", "out/play/*.html"]
    assert {each["name"] for each in steps(JOBS["release"], "actions/download-artifact")} == {"dist", "play"}


def test_a_workflow_may_write_where_it_drafts_the_release_alone():
    assert all(workflow["permissions"] == {"contents": "read"} for workflow in WORKFLOWS.values())
    writes = {
        (name, what)
        for workflow in WORKFLOWS.values()
        for name, job in workflow["jobs"].items()
        for what, may in job.get("permissions", {}).items()
        if may == "write"
    }
    assert writes == {("build", "id-token"), ("build", "attestations"), ("release", "contents")}


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is absent")
def test_the_assets_of_a_release_are_the_sdist_the_wheels_and_the_page_under_its_version(tmp_path):
    """The lines of the workflow, with a `gh` that prints what it is asked for."""
    dist = ["hopform-1.2.3-py3-none-any.whl", "hopform-1.2.3.tar.gz"]
    files = [*(f"dist/{name}" for name in dist), "out/play/index.html"]
    changelog = "# Changelog\n\n## [1.2.3] - 2030-01-01\n\n### Added\n- A door.\n\n## [1.2.2] - 2029-01-01\n"
    for name, text in {**dict.fromkeys(files, ""), "CHANGELOG.md": changelog}.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, "utf-8")
    gh = tmp_path / "bin" / "gh"
    gh.parent.mkdir()
    gh.write_text('#!/bin/sh\nprintf "%s\\n" "$@"\n', "utf-8")
    gh.chmod(0o755)
    around = {**os.environ, "GITHUB_REF_NAME": "v1.2.3", "PATH": f"{gh.parent}{os.pathsep}{os.environ['PATH']}"}

    def run(line):
        asked = ["bash", "-e", "-o", "pipefail", "-c", line]
        return subprocess.run(asked, cwd=tmp_path, env=around, check=True, capture_output=True, text=True).stdout

    (named,) = (line for line in lines(JOBS["build"]) if "out/play" in line)
    run(named)
    (tmp_path / "out" / "play").rename(tmp_path / "play")  # as the artifact is handed on
    noted, drafted = lines(JOBS["release"])
    run(noted)
    assert (tmp_path / "notes.md").read_text("utf-8") == changelog[13 : changelog.index("## [1.2.2]")]
    words = run(drafted).split("\n")[:-1]
    assert words[:5] == ["release", "create", "v1.2.3", "--draft", "--verify-tag"]
    assert words[5:9] == ["--title", "hopform 1.2.3", "--notes-file", "notes.md"]
    assert words[9:] == [*(f"dist/{name}" for name in dist), "play/hopform-play-1.2.3.html"]


def test_no_file_that_is_published_has_an_invented_address():
    """An unknown fact is left out; the names of RFC 2606 stand for none."""
    files = [ROOT / name for name in ("pyproject.toml", "CITATION.cff", "SECURITY.md", "README.md")]
    files += [path for room in ("templates", "generated") for path in (ROOT / room).rglob("*") if path.is_file()]
    assert len(files) > 100
    invented = re.compile(rb"\bexample\.(?:org|com|net)\b|\.(?:example|invalid)\b|TODO|FIXME")
    assert [path for path in files if invented.search(path.read_bytes())] == []
