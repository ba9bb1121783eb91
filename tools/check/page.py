"""The page: a line a look, its fix below; as text and as JSON."""

from __future__ import annotations

import dataclasses
import json
import textwrap
from collections.abc import Iterable, Iterator
from itertools import zip_longest

from rich.text import Text

from bridge.preflight.verdict import Line, Mark, Section, good

WIDTH = 120
_MARK, _WHAT, _FOUND = 9, 22, 44
_STYLES = {Mark.PASS: "green", Mark.WARN: "yellow", Mark.FAIL: "bold red", Mark.UNKNOWN: "bold magenta"}
_WORDS = {Mark.PASS: "pass", Mark.WARN: "warn", Mark.FAIL: "FAIL", Mark.UNKNOWN: "UNKNOWN"}


def to_text(sections: tuple[Section, ...], unchecked: tuple[str, ...]) -> Iterator[Text]:
    """Yield the page's lines."""
    for section in sections:
        yield Text(section.title, style="bold")
        for line in section.lines:
            yield from _rows(line)
        for note in section.notes:
            yield from (Text(" " * _MARK + row, style="dim") for row in _noted(note))
        yield Text()
    yield verdict(sections)
    if unchecked:
        yield Text(f"Not looked at in this run: {'; '.join(unchecked)}.")


def verdict(sections: tuple[Section, ...]) -> Text:
    """Return the page's last word."""
    lines = [line for section in sections for line in section.lines]
    count = {mark: sum(line.mark is mark for line in lines) for mark in Mark}
    if good(lines):
        doubts = f", {count[Mark.WARN]} could be better" if count[Mark.WARN] else ""
        return Text(f"Nothing speaks against flying: {count[Mark.PASS]} lines passed{doubts}.", style="bold green")
    failed, unknown = count[Mark.FAIL], count[Mark.UNKNOWN]
    words = f"DO NOT FLY: {failed} failed, {unknown} unknown. Mend them from the top: the later follow from the first."
    return Text(words, style="bold red")


def to_json(sections: tuple[Section, ...], unchecked: tuple[str, ...]) -> str:
    """Return the page as JSON."""
    lines = [line for section in sections for line in section.lines]
    figures = {
        "good": good(lines),
        "sections": [dataclasses.asdict(section) for section in sections],
        "unchecked": unchecked,
    }
    return json.dumps(figures, indent=2)


def _rows(line: Line) -> Iterator[Text]:
    """Yield a line, and the fix below."""
    if line.what.startswith('"'):  # a text it said, with its meaning: neither column holds it
        yield _row(line.mark, line.what)
        yield from (Text(" " * (_MARK + 2) + row) for row in _wrapped(line.found, WIDTH - _MARK - 2))
    else:
        yield from _columns(line)
    if line.fix:
        for row in textwrap.wrap(f"-> {line.fix}", WIDTH - _MARK - 2, subsequent_indent="   "):
            yield Text(" " * (_MARK + 2) + row, style=_STYLES[line.mark])


def _columns(line: Line) -> Iterator[Text]:
    """Yield what was looked at, what was found and what it must be beside each other, each wrapped within its own."""
    what, found = _wrapped(line.what, _WHAT - 1), _wrapped(line.found, _FOUND - 1)
    needed = _wrapped(line.needed, WIDTH - _MARK - _WHAT - _FOUND)
    for row, (left, middle, right) in enumerate(zip_longest(what, found, needed, fillvalue="")):
        cells = f"{left:<{_WHAT}}{middle:<{_FOUND}}{right}".rstrip()
        yield Text(" " * _MARK + cells) if row else _row(line.mark, cells)


def _noted(note: str) -> list[str]:
    """Return a note wrapped, the rows of a table as they are."""
    return [note] if len(note) <= WIDTH - _MARK else textwrap.wrap(note, WIDTH - _MARK)


def _row(mark: Mark, rest: str) -> Text:
    return Text.assemble((f"{_WORDS[mark]:>{_MARK - 2}}  ", _STYLES[mark]), rest)


def _wrapped(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width) or [""]


def plain(rows: Iterable[Text]) -> str:
    """Return rows as they look without colour."""
    return "".join(f"{row.plain}\n" for row in rows)
