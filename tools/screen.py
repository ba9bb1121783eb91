"""The terminal, as every command writes on it."""

from __future__ import annotations

from rich.console import Console


def screen(*, stderr: bool = False, width: int | None = None, soft_wrap: bool = False) -> Console:
    """Return a console that takes what it is given for text: a file may be called `[red]`, an autopilot say `[/]`.

    Args:
        stderr: there, in place of stdout.
        width: in place of the terminal's own [characters].
        soft_wrap: leave long lines to the terminal.
    """
    return Console(stderr=stderr, width=width, soft_wrap=soft_wrap, markup=False, highlight=False)
