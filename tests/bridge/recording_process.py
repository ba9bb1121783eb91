"""A process that records, to be killed or starved by a test: `python -m tests.bridge.recording_process PATH BYTES`.

After each step its stream time goes to stdout. BYTES, unless 0, is the largest file the kernel lets it write;
the recording ends with its state on stdout once that is reached.
"""

from __future__ import annotations

import resource
import sys
from itertools import count
from pathlib import Path

import numpy as np

from tests.bridge.recordings import recorder, turn

if __name__ == "__main__":
    path, limit_bytes = Path(sys.argv[1]), int(sys.argv[2])
    if limit_bytes:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit_bytes, limit_bytes))
    generator = np.random.default_rng(1)
    wall_ns = 0
    log = recorder(path, capacity=2, tlog=path.with_suffix(".tlog"), wall_clock=lambda: wall_ns)
    for k in count():
        event, step, sent, now_ns = turn(k, generator)
        wall_ns = now_ns
        log.take(event, step, sent, now_ns)
        if log.state().error:
            break
        sys.stdout.write(f"{now_ns}\n")
        sys.stdout.flush()
    for more in range(50):
        log.take(*turn(k + 1 + more, generator))
    log.close()
    state = log.state()
    sys.stdout.write(f"{k + 51} {state.written} {state.dropped} {state.error}\n")
