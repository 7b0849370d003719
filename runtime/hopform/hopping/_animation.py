"""A run as a GIF; `_scene` draws it."""

import base64
import html
import math
from dataclasses import dataclass
from pathlib import Path

from hopform import HopformError
from hopform.extend import finite, needs, positive, shown, whole, write
from hopform.hopping._run import Run

MOST_PICTURES = 5000


@dataclass(frozen=True, repr=False)
class Animation:
    """A GIF: a notebook shows it, `save` writes it."""

    gif: bytes
    title: str

    def __repr__(self) -> str:
        return self.title

    def _repr_html_(self) -> str:
        picture = base64.b64encode(self.gif).decode()
        return f"<img alt='{html.escape(self.title)}' src='data:image/gif;base64,{picture}'>"

    def save(self, path: str | Path) -> None:
        """Write it to a file; HopformError for one whose name does not end in .gif."""
        if not str(path).lower().endswith(".gif"):
            raise HopformError(f"path must end in .gif, which an animation is, got {shown(str(path))}")
        write({path: self.gif})


def animate(
    run: Run, *, h_des: float | None = None, speed: float = 0.5, rate: int = 12, seconds: float | None = None
) -> Animation:
    """The hopper of a `Run` on its ground, moving: foot, actuator, body, with time and current.

    h_des [m]: a desired apex, drawn as a line. speed: 1 is real time. rate [1/s]: pictures. seconds: of the run, all of
    it if left out. Raises HopformError for a value that is not allowed, MissingExtra without matplotlib.

    >>> from hopform import load_robot
    >>> from hopform.hopping import animate, simulate
    >>> run = simulate(load_robot("hopper_c"), [0.0], 3.0, height=0.2)
    >>> animate(run, seconds=0.1, rate=4)
    Animation of hopper_c: 1 pictures, 4 a second
    """
    if not isinstance(run, Run):
        raise HopformError(f"run must be a Run, as simulate gives it, got {shown(run)}")
    set_point = None if h_des is None else finite("h_des", h_des, "m")
    pictures = whole("rate", rate, most=100)
    end = run.duration if seconds is None else min(positive("seconds", seconds, "s"), run.duration)
    count = math.ceil(end / (positive("speed", speed, "of real time") / pictures))
    if count > MOST_PICTURES:
        raise HopformError(f"seconds, rate and speed must make at most {MOST_PICTURES} pictures, got {count}")
    needs("matplotlib", "plot", "an animation")
    from hopform.hopping._scene import gif_of

    gif = gif_of(run, set_point, pictures, [n * speed / pictures for n in range(count)])
    return Animation(gif, f"Animation of {run.robot.label}: {count} pictures, {pictures} a second")
