"""A log's flight once more: its frames through the tracker, with its own settings or others."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from bridge.log.reader import LogReader
from bridge.settings import LinkSettings, Settings
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


def on_paper(settings: Settings) -> Settings:
    """Return settings whose links end in this process: a replay must reach no autopilot by itself.

    Nothing is signed, and no origin told: with nobody there to answer, an ArduPilot's poses would wait for it for ever.
    """
    links = tuple(
        LinkSettings.model_construct(uri=f"memory:{link.uri.replace(':', '/')}", messages=link.messages)
        for link in settings.links
    )
    mavlink = settings.mavlink.model_copy(update={"signing_key": ""})
    return settings.model_copy(update={"links": links, "mavlink": mavlink, "origin": None})
