"""What tests cost in processor time, their children counted, and the ring that follows from it: a plugin of pytest.

`make test` is the first ring, `make test-slices` the second (`sliced`), `make nightly` the third (`nightly`). A test of
more than LIMIT seconds belongs to the first only by name: it stands in tests/durations.json, which `make durations`
writes. One that does not is printed. That is no failure, because seconds on a shared machine are no property of the
code. The file also says which files are begun first.
"""

import json
import resource
import sys
from collections import defaultdict
from pathlib import Path

import pytest

DURATIONS = Path(__file__).with_name("durations.json")
"""Functions of the first ring by name: processor seconds of their dearest parameter, where they are SHOWN or more."""

SHOWN, LIMIT = 0.5, 2.0
"""[s] What is listed, and what is printed where it is not. Machines differ by a factor of two, and one by as much from run to
run, with what shares it and with which test of a process pays for what is made once.
"""

LIBRARY = 20
"""Modules, from which on a library was imported."""

AIM = 360
"""[s] What `make test` may take, from pytest's first line to its end; it is printed beside what it took."""


def processor_seconds() -> float:
    """Of this process and of those that it has waited for."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def durations() -> dict[str, float]:
    return dict(json.loads(DURATIONS.read_text("utf-8")))


made_for_all: list[float] = []
"""[s] What each thing took that this process made for all tests of the run, whichever asked for it first."""


class Rings:
    """Measures in each process; the one that prints the summary collects."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.mark, self.modules = processor_seconds(), len(sys.modules)
        self.by_test: defaultdict[str, float] = defaultdict(float)
        self.of_workers = 0.0
        self.unnamed: list[str] = []

    @property
    def is_whole(self) -> bool:
        """Whether all of the first ring runs, and not some files of it."""
        return self.config.getoption("-m") == FIRST and self.config.args_source is pytest.Config.ArgsSource.TESTPATHS

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Begin with the longest files, so that no worker is left alone with one; the tests of each stay together."""
        known, count = durations(), defaultdict[str, float](float)
        for item in items:
            count[item.nodeid.partition("::")[0]] += known.get(function_of(item.nodeid), 0.0)
        items.sort(key=lambda item: -count[item.nodeid.partition("::")[0]])

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_makereport(self):
        """Processor seconds since the last phase of a test, less what it made for others; none of a test in which a
        library was loaded first, which pays for the others of its process.
        """
        outcome = yield
        self.mark += sum(made_for_all)
        made_for_all.clear()
        now, modules = processor_seconds(), len(sys.modules)
        loads = modules > self.modules + LIBRARY
        outcome.get_result().processor_seconds = 0.0 if loads else now - self.mark
        self.mark, self.modules = now, modules

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call":
            self.by_test[report.nodeid] += getattr(report, "processor_seconds", 0.0)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node) -> None:
        self.of_workers += getattr(node, "workeroutput", {}).get("processor_seconds", 0.0)

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        output = getattr(self.config, "workeroutput", None)
        if output is not None:
            output["processor_seconds"] = processor_seconds()
            return
        by_function = defaultdict[str, float](float)
        for test, seconds in self.by_test.items():
            by_function[function_of(test)] = max(by_function[function_of(test)], seconds)
        if self.config.getoption("--write-durations"):
            listed = {name: round(s, 1) for name, s in sorted(by_function.items()) if s >= SHOWN}
            DURATIONS.write_text(json.dumps(listed, indent=1) + "\n", "utf-8")
        known = durations()
        self.unnamed = [f"{s:.1f} s  {name}" for name, s in by_function.items() if s > LIMIT and name not in known]

    def pytest_terminal_summary(self, terminalreporter) -> None:
        own = resource.getrusage(resource.RUSAGE_SELF)  # its children are the workers, if there are any
        total = self.of_workers + own.ru_utime + own.ru_stime if self.of_workers else processor_seconds()
        if self.is_whole and self.unnamed:
            terminalreporter.write_line(
                f"More than {LIMIT} s and not in {DURATIONS.name}: mark it sliced, or `make durations`"
            )
            for line in self.unnamed:
                terminalreporter.write_line(line)
        aim = f" (aim: {AIM} s)" if self.is_whole else ""
        terminalreporter.write_line(f"{total:.0f} s of processor time{aim}")


FIRST = "not sliced and not nightly and not site"
"""The expression of the first ring, as in pyproject.toml."""


def function_of(test: str) -> str:
    """The name of a test without its parameters."""
    return test.partition("[")[0]
