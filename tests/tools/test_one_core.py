"""The command takes one core, not all of a flight computer's."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import cv2
import pytest

from tools.bench.one_core import one_core
from tools.cli import ONE_THREAD_EACH

ROOT = Path(__file__).parents[2]
ASK = """
import os
from tools.cli import run_command_line
assert run_command_line(["--version"]) == 0
import cv2
import numpy as np
np.linalg.inv(np.eye(200)) @ np.ones((200, 200))
print(cv2.getNumThreads(), len(os.listdir("/proc/self/task")))
"""


def threads(**environment: str) -> list[int]:
    """Return OpenCV's threads, and all of a process, once the command line has started and both have worked."""
    inherited = {name: value for name, value in os.environ.items() if name not in ONE_THREAD_EACH}
    done = subprocess.run(
        [sys.executable, "-c", ASK], cwd=ROOT, env=inherited | environment, capture_output=True, text=True, check=True
    )
    return [int(word) for word in done.stdout.split()[-2:]]


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="only Linux lists a process's threads")
def test_the_command_line_starts_no_threads_for_images_and_matrices() -> None:
    assert threads() == [1, 1]


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="only Linux lists a process's threads")
def test_what_the_operator_allows_them_stays() -> None:
    assert threads(OPENCV_FOR_THREADS_NUM="3")[0] == 3


def test_a_measurement_holds_to_one_core_and_gives_the_others_back() -> None:
    before, cores = cv2.getNumThreads(), os.sched_getaffinity(0)
    with one_core() as pinned:
        assert pinned
        assert cv2.getNumThreads() == 1
        assert len(os.sched_getaffinity(0)) == 1
    assert (cv2.getNumThreads(), os.sched_getaffinity(0)) == (before, cores)
