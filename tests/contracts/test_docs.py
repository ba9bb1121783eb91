"""What the manuals name exists: pages, headings, files, commands and their options."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer
from typer.core import TyperCommand, TyperGroup

from tools.cli import app
from tracker.types import Reason

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
LINK = re.compile(r"\]\(([^)#\s]*)(?:#([^)\s]+))?\)")
CALL = re.compile(r"\bposebridge((?: [a-z]+)+)([^`\n#]*)")
OPTION = re.compile(r"(?<![\w-])--[a-z][\w-]*")
COMMANDS = typer.main.get_command(app)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_leads_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for target, heading in LINK.findall(text):
        if "://" in target:
            continue
        led_to = (page.parent / target) if target else page
        assert led_to.exists(), f"{target} does not exist"
        assert not heading or heading in _anchors(led_to), f"{target} has no heading {heading}"


@pytest.mark.parametrize("page", [page for page in PAGES if page.name != "CHANGELOG.md"], ids=lambda page: page.name)
def test_every_command_shown_exists_with_its_options(page: Path) -> None:
    for words, rest in _calls(page.read_text(encoding="utf-8")):
        command = _command(words)
        assert command is not None, f"posebridge {' '.join(words)} is no command"
        options = {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
        unknown = set(OPTION.findall(rest)) - options - {"--help"}
        assert not unknown, f"posebridge {' '.join(words)} has no {', '.join(unknown)}"


def test_every_reason_for_leaving_something_out_is_explained() -> None:
    text = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
    explained = re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE)
    assert set(Reason) <= set(explained)


def test_the_checks_find_something() -> None:
    calls = [words for page in PAGES for words, _ in _calls(page.read_text(encoding="utf-8"))]
    assert {"run", "demo", "check", "calibrate"} <= {words[0] for words in calls}


def _anchors(page: Path) -> set[str]:
    """Return the headings of a page as links name them."""
    lines = [line for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("#")]
    return {re.sub(r"[^\w\s-]", "", line.lstrip("#").strip().lower()).replace(" ", "-") for line in lines}


def _calls(text: str) -> Iterator[tuple[list[str], str]]:
    """Yield the words and the rest of each command line shown, in a block or between backticks."""
    blocks = re.findall(r"```.*?```|`[^`\n]+`|^    [^\n]*$", text, re.DOTALL | re.MULTILINE)
    for block in blocks:
        for words, rest in CALL.findall(block):
            yield words.split(), rest


def _command(words: list[str]) -> TyperCommand | TyperGroup | None:
    """Return the command that words name, its arguments left aside."""
    command: object = COMMANDS
    for word in words:
        if not isinstance(command, TyperGroup):
            break
        command = command.commands.get(word)
    return command if isinstance(command, TyperCommand | TyperGroup) else None
