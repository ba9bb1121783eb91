"""Commands as typer makes them, but for `--help`, which takes no value and shows no type of one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import typer
from typer.core import TyperCommand, TyperGroup

F = TypeVar("F", bound=Callable[..., Any])


class _Command(TyperCommand):
    def get_help_option(self, ctx: Any) -> Any:
        """Return the option, without a type."""
        return _untyped(super().get_help_option(ctx))


class _Group(TyperGroup):
    def get_help_option(self, ctx: Any) -> Any:
        """Return the option, without a type."""
        return _untyped(super().get_help_option(ctx))


class Commands(typer.Typer):
    """A group of commands."""

    def __init__(self, **terms: Any) -> None:
        super().__init__(cls=_Group, **terms)

    def command(self, *name: Any, **terms: Any) -> Callable[[F], F]:
        """Add a command, as typer does."""
        return super().command(*name, cls=_Command, **terms)


def _untyped(option: Any) -> Any:
    if option is not None:
        option.metavar = ""
    return option
