"""Keys: only a file that is the user's alone is taken, and every refusal says what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.signing.key import make_key, open_key
from tools.cli import run_command_line
from tracker.errors import OperatorError


def write(path: Path, data: bytes, mode: int = 0o600) -> Path:
    path.write_bytes(data)
    path.chmod(mode)
    return path


def test_a_key_that_was_made_opens_and_is_no_other_ones(tmp_path: Path) -> None:
    secrets = set()
    for name in ("a", "b"):
        make_key(tmp_path / name)
        key = open_key(tmp_path / name)
        secrets.add(key.secret)
        key.release()
        assert (tmp_path / name).stat().st_mode & 0o777 == 0o600
    assert len(secrets) == 2
    assert {len(secret) for secret in secrets} == {32}


def test_raw_bytes_and_hex_digits_are_the_same_key(tmp_path: Path) -> None:
    secret = bytes(range(1, 33))
    for name, data in (
        ("raw", secret),
        ("hex", secret.hex().encode()),
        ("line", secret.hex().upper().encode() + b"\n"),
    ):
        key = open_key(write(tmp_path / name, data))
        assert key.secret == secret
        key.release()


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660, 0o644, 0o602])
def test_a_key_that_others_may_touch_is_refused(mode: int, tmp_path: Path) -> None:
    with pytest.raises(OperatorError, match=f"mode {mode:o}.*chmod 600"):
        open_key(write(tmp_path / "key", bytes(range(32)), mode))


@pytest.mark.parametrize("data", [b"", b"x" * 31, b"x" * 33, b"g" * 64, b"ab" * 31, b"\xff" * 64])
def test_what_is_no_key_is_refused(data: bytes, tmp_path: Path) -> None:
    with pytest.raises(OperatorError, match="32 bytes, or 64 hex digits"):
        open_key(write(tmp_path / "key", data))


def test_the_key_of_zeros_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OperatorError, match="all zero"):
        open_key(write(tmp_path / "key", bytes(32)))


def test_a_key_in_use_is_refused_until_it_is_let_go(tmp_path: Path) -> None:
    path = write(tmp_path / "key", bytes(range(32)))
    first = open_key(path)
    with pytest.raises(OperatorError, match="another posebridge"):
        open_key(path)
    first.release()
    first.release()
    open_key(path).release()


def test_a_key_is_never_shown(tmp_path: Path) -> None:
    key = open_key(write(tmp_path / "key", b"0123456789abcdef0123456789abcdef"))
    assert "0123" not in repr(key)
    key.release()


def test_no_key_is_replaced_and_a_missing_one_names_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "vehicle.key"
    assert run_command_line(["key", str(path)]) == 0
    made = path.read_bytes()
    assert run_command_line(["key", str(path)]) == 2
    assert path.read_bytes() == made
    assert "never replaced" in capsys.readouterr().err
    with pytest.raises(OperatorError, match="`posebridge key"):
        open_key(tmp_path / "none")
