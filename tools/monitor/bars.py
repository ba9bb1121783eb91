"""Rows of small bars: a history or a histogram in one line of text."""

from __future__ import annotations

from collections.abc import Sequence

BLOCKS = " ▁▂▃▄▅▆▇█"
PLAIN = " .:-=+*%@"  # for terminals without Unicode


def bars(values: Sequence[float | None], width: int, glyphs: str = BLOCKS, top: float | None = None) -> str:
    """Return one glyph for each of `width` groups of values, its height by the largest of the group.

    Args:
        values: none negative; None for what is not known, drawn as a gap.
        width: most glyphs [characters].
        glyphs: from nothing to full.
        top: the value of a full bar; the largest of the values if None.
    """
    if not values:
        return ""
    groups = _groups(values, width)
    known = [value for value in groups if value is not None]
    full = (max(known, default=0.0) if top is None else top) or 1.0
    return "".join(glyphs[0] if value is None else glyphs[_height(value / full, len(glyphs) - 1)] for value in groups)


def _groups(values: Sequence[float | None], width: int) -> list[float | None]:
    """Return the largest value of each of at most `width` groups of neighbours, the newest group whole."""
    size = -(-len(values) // width)
    starts = range(len(values) % size - size if len(values) % size else 0, len(values), size)
    return [_largest(values[max(start, 0) : start + size]) for start in starts]


def _largest(values: Sequence[float | None]) -> float | None:
    return max((value for value in values if value is not None), default=None)


def _height(share: float, most: int) -> int:
    """Return how many steps high a bar is: something is never drawn as nothing."""
    return 0 if share <= 0.0 else min(most, max(1, round(share * most)))
