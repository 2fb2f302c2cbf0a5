"""What every command shares: the terminal and progress."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

said = Console(stderr=True, highlight=False, emoji=False)
out = Console(highlight=False, emoji=False, soft_wrap=True)


# Measured on an empty cache, as work of one core: 6 s for a mesh, 14 s for a picture, 20 to 30 s for a plate, 36 s for the demo.
COMPILING = "Compiling kernels, once for each kind of scan and picture; this takes 10 to 40 seconds, longer on a busy computer."
# Keywords of the library that are options here, and what is spelt in another way.
KEYWORD = re.compile(
    r"(?:^|(?<=[\s(]))(axes|fill|index|inside|islands|iso|label|raw|series|spacing)=\"?([^\s\";,.:)]*(?:\.\.\w+)?)\"?"
)
PHRASES = {"with cap=True": "without --open"}


def spoken(text: str) -> str:
    """A message of the library in the words of the command line: fill=VALUE is --fill VALUE."""
    for phrase, option in PHRASES.items():
        text = text.replace(phrase, option)
    return KEYWORD.sub(lambda found: f"--{found[1]} {found[2]}".rstrip(), text)


def say(text: str, style: str | None = None) -> None:
    """One line on standard error; only a terminal may break it."""
    said.print(" ".join(spoken(text).split()), style=style, markup=False, soft_wrap=not said.is_terminal)


class Steps:
    """A progress bar a stage, on the terminal only; the seconds each one took."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[count]}"),
            TimeElapsedColumn(),
            console=said,
            transient=True,
            disable=not said.is_terminal,
        )

    @contextmanager
    def step(self, name: str, counted: str = "") -> Iterator[Callable[[int, int], None]]:
        """A stage. What is `counted`, if anything, is shown as number and with the time left."""
        begun = time.perf_counter()
        task = self.bar.add_task(name, total=None, count="")

        def progress(done: int, total: int) -> None:
            left = timedelta(seconds=round((time.perf_counter() - begun) / done * (total - done))) if done else "some time"
            self.bar.update(task, completed=done, total=total, count=f"{done} of {total} {counted}, {left} left" * bool(counted))

        yield progress
        self.bar.remove_task(task)
        self.seconds[name] = time.perf_counter() - begun

    def summary(self) -> str:
        parts = ", ".join(f"{name} {seconds:.2f}" for name, seconds in self.seconds.items())
        return f"{sum(self.seconds.values()):.2f} s ({parts})"


@contextmanager
def running() -> Iterator[Steps]:
    from intaglio.compute import announcing_compilation, thread_count

    thread_count()  # refuses a bad INTAGLIO_THREADS before any work
    steps = Steps()
    with steps.bar, announcing_compilation(lambda: say(COMPILING)):
        yield steps
