"""The vehicle's pose in the log is packed byte for byte as protobuf's own classes do."""

from __future__ import annotations

from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from hypothesis import example, given
from hypothesis import strategies as st

from bridge.log.vehicle import pose_and_transform

numbers = st.one_of(st.just(0.0), st.just(-0.0), st.floats())
times = st.one_of(st.integers(-(10**18), 4 * 10**18), st.just(0), st.integers(-5, 5).map(lambda s: s * 10**9))


@given(t_ns=times, p=st.lists(numbers, min_size=3, max_size=3), q=st.lists(numbers, min_size=4, max_size=4))
@example(t_ns=0, p=[0.0, 0.0, 0.0], q=[1.0, 0.0, 0.0, 0.0])
@example(t_ns=1_700_000_000_123_456_789, p=[0.1, -0.2, 1.0], q=[0.5, 0.5, -0.5, 0.5])
def test_the_bytes_are_those_of_protobufs_own_classes(t_ns: int, p: list[float], q: list[float]) -> None:
    pose, transform = PoseInFrame(frame_id="room"), FrameTransform(parent_frame_id="room", child_frame_id="body")
    for stamp in (pose.timestamp, transform.timestamp):
        stamp.seconds, stamp.nanos = divmod(t_ns, 10**9)
    for place in (pose.pose.position, transform.translation):
        place.x, place.y, place.z = p
    for turn in (pose.pose.orientation, transform.rotation):
        turn.w, turn.x, turn.y, turn.z = q
    assert pose_and_transform(t_ns, p, q) == (pose.SerializeToString(), transform.SerializeToString())
