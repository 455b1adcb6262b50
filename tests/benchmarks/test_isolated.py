"""Work in a process of its own: results come back, limits hold, failures say what happened."""

import math
import time

import numpy as np
import pytest

from benchmarks.isolated import WorkerError, in_own_process


def test_a_result_comes_back_with_its_cost():
    done = in_own_process(math.hypot, 3.0, 4.0, limit=10)
    assert done.value == 5.0
    assert done.cpu_seconds < 1.0
    assert 5.0 < done.peak_mb < 500.0


def test_the_peak_is_that_of_the_work_not_of_whoever_asked():
    held = np.ones(40_000_000)
    small = in_own_process(math.hypot, 3.0, 4.0, limit=10)
    assert small.peak_mb < 1e-6 * held.nbytes


@pytest.mark.slow
def test_work_that_takes_too_long_is_stopped():
    done = in_own_process(_busy, limit=1)
    assert done.value is None
    assert done.cpu_seconds >= 1.0


def test_what_work_prints_does_not_disturb_its_result():
    assert in_own_process(_chatty, limit=10).value == "done"


def test_a_failure_says_what_failed():
    with pytest.raises(WorkerError, match=r"math\.sqrt failed(.|\n)*domain"):
        in_own_process(math.sqrt, -1.0, limit=10)


def _busy():
    while True:
        time.process_time()


def _chatty():
    print("chatter")
    return "done"
