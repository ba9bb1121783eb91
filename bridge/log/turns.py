"""A log turned back into the turns of the loop that it was written from, as far as figures need them."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from bridge.heard import NOTHING, Heard
from bridge.log import received, topics, triangle
from bridge.log.reader import LogReader, Record
from bridge.wire import Sent
from tracker.standing import CameraHealth, Health, Witness
from tracker.types import Array, BallSighting, Estimate, Event, Frame, Reason, Rejected, Step, TrackState, frozen_array

_NO_IMAGE = np.zeros((0, 0, 3), np.uint8)
_FAR_TOPICS = frozenset({t.name for t in (received.TIMESYNC, received.AUTOPILOT, received.LINK)})
_TOPICS = _FAR_TOPICS | {
    t.name for t in (topics.SIGHTINGS, topics.REJECTIONS, topics.HEALTH, topics.ESTIMATE, topics.LATENCY, topics.LOG)
}
_STATES = {state.value: state for state in TrackState}
_REASONS = {reason.value: reason for reason in Reason}


class LoggedTurn(NamedTuple):
    """One record as a turn of the loop. now_ns: stream time when it was taken [ns].  heard: without what came in."""

    event: Event | None
    step: Step
    sent: tuple[Sent, ...]
    now_ns: int
    heard: Heard = NOTHING


def turns(reader: LogReader) -> Iterator[LoggedTurn]:
    """Yield a log's records in order, each as a turn; frames have no image, silences are not logged."""
    state = TrackState.SEARCHING
    waiting: dict[str, Any] | None = None  # an estimate, whose stage times stand in the record after it
    for record in reader.records(_Wanted()):
        value, now_ns = record.value, record.log_ns
        if record.topic == topics.LOG.name:
            state = _new_state(record, state)
            yield LoggedTurn(None, Step(state), (), now_ns)
        elif record.topic == topics.SIGHTINGS.name:
            step = Step(state, sightings=_sightings(value, used=True), refused=_sightings(value, used=False))
            yield LoggedTurn(_frame(value), step, (), now_ns)
        elif record.topic == topics.REJECTIONS.name:
            yield LoggedTurn(None, Step(state, rejections=_rejections(value)), (), now_ns)
        elif record.topic == topics.HEALTH.name:
            yield LoggedTurn(None, Step(state, health=_health(value)), (), now_ns)
        elif record.topic == topics.ESTIMATE.name:
            waiting = value
        elif record.topic == topics.LATENCY.name:
            if waiting is not None and waiting["t_ns"] == value["t_ns"]:
                estimate = _estimate(waiting, value)
                state = estimate.state
                yield LoggedTurn(None, Step(state, estimates=(estimate,)), (), now_ns)
            waiting = None
        elif record.topic in _FAR_TOPICS:
            yield LoggedTurn(None, Step(state), (), now_ns, _heard(record))
        else:
            yield LoggedTurn(None, Step(state), (_sent(record),), now_ns)


class _Wanted:
    """The topics that figures come from."""

    def __contains__(self, topic: object) -> bool:
        return topic in _TOPICS or (isinstance(topic, str) and topic.startswith(topics.SENT_PREFIX))


def _heard(record: Record) -> Heard:
    value = record.value
    if record.topic == received.TIMESYNC.name:
        return Heard(clocks=((value["link"], received.clock_of(value)),))
    if record.topic == received.AUTOPILOT.name:
        return Heard(far_ends=((value["link"], received.autopilot_of(value)),))
    return Heard(links=(received.link_of(value),))


def _new_state(record: Record, state: TrackState) -> TrackState:
    """Read `searching -> tracking`; the log panel holds other lines too."""
    return _STATES.get(record.value.message.split(" -> ")[-1], state) if record.value.name == "tracker" else state


def _frame(value: dict[str, Any]) -> Frame:
    return Frame(value["camera"], value["t_ns"], _NO_IMAGE, value["available_ns"])


def _health(value: dict[str, Any]) -> Health:
    cameras = tuple(
        CameraHealth(
            one["name"],
            one["moved"],
            Witness(one["witness"]),
            one["shift_px"],
            one["at_vehicle_mm"],
            one.get("full_share", 0.0),
        )
        for one in value["cameras"]
    )
    figures = value["at_odds"], value["epipolar_px"], value["spacing_mm"]
    return Health(value["t_ns"], cameras, *figures, value.get("from_start", False))  # logs of before lack some words


def _sightings(value: dict[str, Any], *, used: bool) -> tuple[BallSighting, ...]:
    """Return those that the estimate went by, or the others; in a log of before both were kept all were used."""
    return tuple(
        BallSighting(
            one["camera"],
            one["ball"],
            one["t_ns"],
            frozen_array([one["u_px"], one["v_px"]]),
            frozen_array([one["cov_px2"][:2], one["cov_px2"][1:]]),
        )
        for one in value["sightings"]
        if one.get("used", True) is used
    )


def _rejections(value: dict[str, Any]) -> tuple[Rejected, ...]:
    """Return what was left out; a reason of another version of the bridge is passed over."""
    return tuple(
        Rejected(_REASONS[one["reason"]], one["detail"], one["t_ns"], None if one["camera"] < 0 else one["camera"])
        for one in value["rejections"]
        if one["reason"] in _REASONS
    )


def _estimate(value: dict[str, Any], latency: dict[str, Any]) -> Estimate:
    return Estimate(
        t_ns=value["t_ns"],
        p_BinW=frozen_array(value["p_BinW_m"]),
        R_BtoW=frozen_array(Rotation.from_quat(value["q_BtoW"], scalar_first=True).as_matrix()),
        v_BinW=frozen_array(value["v_BinW_m_s"]),
        w_BinB=frozen_array(value["w_BinB_rad_s"]),
        covariance=frozen_array(triangle.unpack(value["covariance"])),
        state=_STATES.get(value["state"], TrackState.TRACKING),
        reset_counter=value["reset_counter"],
        nis=float("nan") if value["nis"] is None else value["nis"],
        nis_dof=value["nis_dof"],
        available_ns=value["available_ns"],
        stages_ns=MappingProxyType({stage["name"]: stage["duration_ns"] for stage in latency["stages"]}),
        clock_offsets_s=_with_first(value.get("clock_offsets_ms", ())),
        clock_sigmas_s=_with_first(value.get("clock_sigmas_ms", ())),
    )


def _with_first(values_ms: Sequence[float]) -> Array:
    """Return what the log says of every camera but the first in seconds, the first one's zero before it."""
    return frozen_array([0.0, *(value / 1e3 for value in values_ms)] if values_ms else ())


def _sent(record: Record) -> Sent:
    value = record.value
    return Sent(
        link=value["link"],
        message=record.topic.removeprefix(topics.SENT_PREFIX),
        t_ns=value["t_ns"],
        sent_ns=value["sent_ns"],
        available_ns=value["available_ns"],
        raw=base64.b64decode(value["raw"]),
        fields=value["fields"],
    )
