"""Other threads of Python go on while a call computes."""

from __future__ import annotations

import sys
import threading

import pytest

import holdfast


@pytest.fixture
def no_forced_switches():
    """Threads take turns only where one lets go of the interpreter's lock."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(3600)
    yield
    sys.setswitchinterval(interval)


def test_lock_is_released(kinect, no_forced_switches):
    """Another thread that waits for the lock gets it during the call: between reading
    `ticks` before and after, nothing else here lets go of it."""
    image = holdfast.simulate("rocks", kinect, stride=2)
    ticks = 0
    is_waiting = threading.Event()
    is_over = False

    def tick():
        nonlocal ticks
        is_waiting.set()
        while not is_over:
            ticks += 1
            threading.Event().wait(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    is_waiting.wait()
    before = ticks
    holdfast.extract(image.points, kinect, radius_m=0.1, spacing_m=0.03, threads=1)
    during = ticks - before
    is_over = True
    thread.join()
    assert during > 0
