"""A progress bar: on a terminal, and in a notebook that has ipywidgets."""

import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from importlib.util import find_spec

Progress = Callable[[int, int], object]
"""What is called with how much is done and the total, now and then; what it raises ends the work."""

BAR_AFTER = 2.0
"""[s] after which a progress bar appears."""


@contextmanager
def progress_bar(what: str) -> Generator[Callable[..., None], None, None]:
    """A moving bar on the error stream if this takes longer than `BAR_AFTER` and a person is there to see it.

    The function that it yields takes what is done and the total, and moves the bar; a text besides renames it.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    seen = find_spec("ipywidgets") is not None if console.is_jupyter else console.is_terminal
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    bar = Progress(*columns, console=console, transient=True, disable=not seen)
    task = bar.add_task(what, total=None)

    def moved(done: int, total: int, words: str = what) -> None:
        bar.update(task, completed=done, total=total, description=words)

    timer = threading.Timer(BAR_AFTER, bar.start)
    timer.start()
    try:
        yield moved
    finally:
        timer.cancel()
        timer.join()
        bar.stop()
