"""The command as its user meets it: a process with arguments, two streams and an exit code."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from inspect import cleandoc
from itertools import takewhile
from pathlib import Path
from typing import Any

import pytest
from rich.text import Text
from typer.main import get_command

from bridge.settings import shipped_configs
from tests.bridge.recordings import record, turns
from tools.cli import app

ROOT = Path(__file__).parents[2]
LAB = shipped_configs()["lab"].read_text(encoding="utf-8")
COMMANDS = {"run", "demo", "export", "calibrate", "room"}


def posebridge(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "tools", *map(str, arguments)],
        cwd=ROOT, env=os.environ | {"COLUMNS": "100"}, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip


def refusal(*arguments: str | Path) -> str:
    """Return the one line on stderr of a command that must be refused with exit code 2 and nothing on stdout."""
    done = posebridge(*arguments)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert done.stderr.endswith("\n")
    assert done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("posebridge: error: ")
    return done.stderr.removeprefix("posebridge: error: ").rstrip()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ([], "Missing command"),
        (["fly"], "No such command 'fly'"),
        (["run", "--config"], "Option '--config' requires an argument"),
        (["run", "--config", "lab", "--sauce", "x"], "No such option: --sauce"),
        (["run", "--config", "lab", "--pace", "slow"], "Invalid value for '--pace': 'slow' is not one of"),
        (["run", "--config", "lab", "more"], "Got unexpected extra argument"),
        (["demo", "--duration_s", "long"], "Invalid value for '--duration_s'"),
        (["demo", "--seed", "1.5"], "Invalid value for '--seed'"),
        (["export"], "Missing argument 'log'"),
        (["export", "a.mcap"], "Missing option '--format'"),
        (["calibrate", "room", "--seconds", "long"], "Invalid value for '--seconds'"),
        (["export", "a.mcap", "--format", "xls"], "Invalid value for '--format': 'xls' is not one of"),
    ],
)  # fmt: skip
def test_wrong_usage_is_one_line_that_points_to_the_help(arguments: list[str], complaint: str) -> None:
    line = refusal(*arguments)
    assert complaint in line
    command = " ".join(["posebridge", *takewhile(lambda word: word in COMMANDS, arguments)])
    assert line.endswith(f"; see `{command} --help`")


def described(command: Any) -> Iterator[Any]:
    """Yield a command and its options, and those of the commands under it."""
    yield command
    yield from command.params
    for each in getattr(command, "commands", {}).values():
        yield from described(each)


def test_no_help_is_taken_for_markup_and_swallowed() -> None:
    texts = [each.help for each in described(get_command(app)) if each.help]
    assert len(texts) > 100
    assert [Text.from_markup(text).plain for text in texts] == texts


def test_no_line_of_a_help_page_breaks_within_a_sentence() -> None:
    """Typer joins the lines of the first paragraph alone."""
    pages = [cleandoc(each.help).split("\n\n") for each in described(get_command(app)) if each.help]
    lines = [line for page in pages for paragraph in page[1:] for line in paragraph.splitlines()]
    assert len(lines) > 10
    assert [line for line in lines if not line.endswith(".")] == []


def test_an_option_without_a_value_shows_none_in_its_help() -> None:
    flags = [each for each in described(get_command(app)) if getattr(each, "is_flag", False)]
    assert {each.metavar for each in flags} == {""}
    for page in ("--help",), ("run", "--help"), ("calibrate", "--help"), ("bench", "speed", "--help"):
        shown = posebridge(*page).stdout
        assert "Show this message and exit" in shown
        assert "<bool>" not in shown


@pytest.mark.parametrize("duration_s", ["0", "-3", "nan", "inf", "1e9"])
def test_a_demo_of_no_sensible_length_is_refused(duration_s: str) -> None:
    assert "s must be 15 to 3600 s" in refusal("demo", f"--duration_s={duration_s}")


def test_a_demo_with_a_negative_seed_is_refused() -> None:
    assert refusal("demo", "--seed=-1") == "--seed: -1 must be 0 or more; give another number"


def test_a_missing_config_lists_the_shipped_ones() -> None:
    assert refusal("run", "--config", "nowhere") == (
        "config nowhere: cannot be read (No such file or directory); shipped configs: lab; or give a path to a .toml"
    )


def test_an_unknown_key_of_a_config_names_the_known_ones(tmp_path: Path) -> None:
    config = tmp_path / "room.toml"
    config.write_text(LAB.replace("coast_limit_ms", "coast_ms", 1), encoding="utf-8")
    line = refusal("run", "--config", config)
    assert line.startswith(f"config {config}: [tracker] unknown key coast_ms; ")
    assert "known keys: method, coast_limit_ms" in line


def test_a_config_that_is_no_toml_names_the_line(tmp_path: Path) -> None:
    config = tmp_path / "room.toml"
    config.write_text("[room]\nroom_yaw_deg == 3\n", encoding="utf-8")
    assert "line 2" in refusal("run", "--config", config)


def test_frames_without_a_log_to_keep_them_in_are_refused() -> None:
    assert refusal("run", "--log-frames", "png") == (
        "--log-frames: there is no log to keep them in; add --log FILE.mcap"
    )


def test_room_for_frames_that_nobody_keeps_is_refused(tmp_path: Path) -> None:
    assert refusal("run", "--log", tmp_path / "flight.mcap", "--log-frames-mb", "30") == (
        "--log-frames-mb 30: no frames are kept; add --log-frames jpeg or png"
    )


def test_a_log_without_frames_cannot_be_replayed(tmp_path: Path) -> None:
    record(tmp_path / "flight.mcap", turns(2))
    assert "holds no config; name one with --config" in refusal("replay", tmp_path / "flight.mcap")
    assert "holds no frames; record one with `run --log FILE --log-frames png`" in refusal(
        "replay", tmp_path / "flight.mcap", "--config", "lab"
    )


def test_a_log_that_is_not_there_cannot_be_exported(tmp_path: Path) -> None:
    assert "gone.mcap" in refusal("export", tmp_path / "gone.mcap", "--format", "tum")


@pytest.mark.parametrize(
    "command", ["export . --format csv", "export / --format tlog", "sysid .", "monitor .", "replay ."]
)
def test_a_folder_in_place_of_a_log_is_refused(command: str) -> None:
    arguments = command.split()
    assert refusal(*arguments) == f"log {arguments[1]}: is no regular file; name a log file"


def test_a_table_goes_beside_the_log_or_to_stdout(tmp_path: Path) -> None:
    log = tmp_path / "flight.mcap"
    record(log, turns(20))
    beside = posebridge("export", log, "--format", "tum")
    table = (tmp_path / "flight.tum").read_text(encoding="ascii")
    assert (beside.returncode, beside.stdout) == (0, "")
    assert beside.stderr == f"{len(table.splitlines())} estimates written to {tmp_path / 'flight.tum'}\n"
    to_stdout = posebridge("export", log, "--format", "tum", "--out", "-")
    assert (to_stdout.returncode, to_stdout.stdout, to_stdout.stderr) == (0, table, "")


def test_a_name_that_looks_like_markup_is_a_name(tmp_path: Path) -> None:
    for name in ("lab[red].mcap", "a[/b].mcap"):
        log = tmp_path / name
        log.parent.mkdir(exist_ok=True)
        record(log, turns(2))
        assert posebridge("export", log, "--format", "tum").stderr == (
            f"2 estimates written to {log.with_suffix('.tum')}\n"
        )


def test_a_reader_who_leaves_early_is_no_traceback(tmp_path: Path) -> None:
    log = tmp_path / "flight.mcap"
    record(log, turns(2000))  # more than a pipe holds
    command = f"{shlex.join([sys.executable, '-m', 'tools', 'export', str(log)])} --format csv --out - | head -1"
    done = subprocess.run(["bash", "-c", command], cwd=ROOT, capture_output=True, text=True, check=False, timeout=60)
    assert done.stdout.startswith("t_ns,")
    assert done.stderr == ""


def test_help_lists_every_command() -> None:
    done = posebridge("--help")
    assert done.returncode == 0
    assert all(command in done.stdout for command in ("run", "demo", "export", "--version"))


def test_version_is_one_line() -> None:
    done = posebridge("--version")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("posebridge ")
    assert done.stdout.count("\n") == 1


def test_help_loads_neither_images_nor_links() -> None:
    heavy = "{'cv2', 'pymavlink', 'pydantic', 'scipy', 'mcap'}"
    code = f"import sys, tools.cli; sys.exit(bool({heavy} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False, timeout=60).returncode == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_command_in_order_with_130_however_often_it_comes(number: signal.Signals) -> None:
    """A command that waits stands for `run`: its `finally` is where log and links are closed."""
    code = """
import os, signal, sys
from tools import cli
@cli.app.command()
def wait():
    try:
        os.kill(os.getpid(), int(sys.argv[1]))
        signal.pause()
    finally:
        os.kill(os.getpid(), int(sys.argv[1]))
        print("closed", flush=True)
sys.exit(cli.run_command_line(["wait"]))
"""
    done = subprocess.run(
        [sys.executable, "-c", code, str(int(number))],
        cwd=ROOT, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (130, "closed\n", "")


def test_a_signal_that_got_lost_in_a_library_is_quiet_and_the_next_one_counts() -> None:
    code = """
import ctypes, os, signal, sys
from tools import cli
def interrupt():
    os.kill(os.getpid(), signal.SIGINT)
    for _ in range(1000):
        pass
@cli.app.command()
def wait():
    ctypes.CFUNCTYPE(None)(interrupt)()
    print("lost", flush=True)
    interrupt()
    print("deaf", flush=True)
sys.exit(cli.run_command_line(["wait"]))
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "lost\n", "")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("module", ["tools.cli", "typer", "tools.commands.logs"])
def test_a_signal_while_the_command_line_is_loaded_is_quiet_too(module: str, number: signal.Signals) -> None:
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]
    entry, _, function = scripts["posebridge"].partition(":")
    code = f"""
import os, sys
class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == "{module}":
            os.kill(os.getpid(), {int(number)})
sys.meta_path.insert(0, Interrupting())
from {entry} import {function}
{function}()
"""
    done = subprocess.run(
        [sys.executable, "-c", code, "--version"], cwd=ROOT, capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
