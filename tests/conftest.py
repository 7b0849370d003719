"""What the tests share: the robots, and the rule that in CI a skipped test fails."""

import os
from pathlib import Path

import pytest

import hopform
from tests.rings import Rings
from tests.seeds import SEED

collect_ignore = [
    "repository/manifests.py",  # `make test-manifests`, in an environment of its own
    "models",  # files of elements: one declares a model where `read_model` runs it, and is no module to import
]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--write-durations", action="store_true", help="write tests/durations.json, see tests/rings.py")


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Rings(config))


@pytest.fixture(scope="session")
def store(tmp_path_factory) -> Path:
    """Where tests/objects.py keeps objects: one folder for all workers of a run."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "objects_of_all"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def hopper_c() -> hopform.Robot:
    return hopform.load_robot("hopper_c")


def pytest_report_header() -> list[str]:
    return [
        f"hopform {hopform.__version__}; {hopform.library_message() or 'with its library'}",
        f"seed {SEED} (HOPFORM_SEED={SEED} repeats it, HOPFORM_SEED=fresh draws another)",
    ]


def pytest_sessionfinish(session: pytest.Session) -> None:
    """With HOPFORM_CI set nothing is absent, so a skipped test is a failure."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    skipped = len(reporter.stats.get("skipped", [])) if reporter else 0
    if os.environ.get("HOPFORM_CI") and skipped and session.exitstatus == 0:
        print(f"\nHOPFORM_CI is set and {skipped} tests were skipped: that is a failure here")
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
