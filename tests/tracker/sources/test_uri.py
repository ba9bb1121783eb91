"""What the operator writes after --source."""

from __future__ import annotations

import pytest

from tracker.errors import OperatorError
from tracker.sources.uri import SourceKind, parse_source


@pytest.mark.parametrize(
    ("text", "kind", "items"),
    [
        ("recording:../lab flight", SourceKind.RECORDING, ("../lab flight",)),
        ("video:a.mp4, b.mp4", SourceKind.VIDEO, ("a.mp4", "b.mp4")),
        ("camera:0,/dev/video2", SourceKind.CAMERA, ("0", "/dev/video2")),
        ("camera:rtsp://cam:554/a,1", SourceKind.CAMERA, ("rtsp://cam:554/a", "1")),
        ("camera:v4l2src ! a,b=1 ! appsink; 1", SourceKind.CAMERA, ("v4l2src ! a,b=1 ! appsink", "1")),
        ("camera:", SourceKind.CAMERA, ()),
        ("sim:hover", SourceKind.SIM, ("hover",)),
    ],
)
def test_a_source_is_a_kind_and_its_items(text: str, kind: SourceKind, items: tuple[str, ...]) -> None:
    uri = parse_source(text)
    assert uri.kind is kind
    assert uri.items == items
    assert parse_source(str(uri)) == uri


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("lab-flight", "no kind before a colon"),
        ("record:lab", "unknown kind 'record'"),
        ("recording:", "write recording:DIR"),
        ("video: ", "write video:LEFT.mp4,RIGHT.mp4"),
        ("", "no kind"),
    ],
)
def test_what_is_no_source_is_told_with_the_known_kinds(text: str, told: str) -> None:
    with pytest.raises(OperatorError, match=told) as error:
        parse_source(text)
    assert "\n" not in str(error.value)
