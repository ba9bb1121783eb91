"""A log's flight once more: its frames through the tracker, with its own settings or others."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from bridge.links import on_paper
from bridge.log.reader import LogReader
from bridge.log.received import AUTOPILOT
from bridge.settings import Settings
from tracker.errors import OperatorError

CONFIG_ATTACHMENT = "config.json"


def settings_of(log: Path) -> Settings:
    """Return the settings a log was recorded with; its calibration is the one attached.

    Raises:
        OperatorError: no log, no config in it, or one of a version that this one cannot read.
    """
    attached = LogReader(log).attachments().get(CONFIG_ATTACHMENT)
    if attached is None:
        raise OperatorError(f"log {log}: holds no config; name one with --config")
    try:
        settings = Settings.model_validate_json(attached)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise OperatorError(
            f"log {log}: its config is not one of this version ({where}: {first['msg']}); name one with --config"
        ) from error
    return settings.model_copy(update={"rig": settings.rig.model_copy(update={"calibration": ""})})


def met_autopilot(log: Path) -> bool:
    """Say whether a log's flight heard an autopilot."""
    return any(record.value["heard"] for record in LogReader(log).records({AUTOPILOT.name}))


def grounded(settings: Settings, *, answered: bool) -> Settings:
    """Return settings whose links end in this process: a replay must reach no autopilot by itself.

    Nothing is signed. answered: an autopilot's answers come in again; without, no origin is told, for which an
    ArduPilot's poses would wait for ever.
    """
    links = tuple(link.model_copy(update={"uri": on_paper(link.uri)}) for link in settings.links)
    mavlink = settings.mavlink.model_copy(update={"signing_key": ""})
    origin = settings.origin if answered else None
    return settings.model_copy(update={"links": links, "mavlink": mavlink, "origin": origin})
