"""Work in a copy of the process: what it gives, says, raises, and how it ends."""

from __future__ import annotations

import os
import signal
import threading

import pytest

from coop_drake.cli.planning_process import beside
from coop_drake.compiling import COMPILING, kernel_clock
from coop_drake.errors import PlanError, ProcessError, RefusalError


def nothing(*_):
    pass


def test_the_copy_works_while_this_process_does_something_else():
    done, steps = threading.Event(), []

    def work(progress):
        progress("searching", 0.5)
        assert not done.is_set()  # That is another process's.
        return os.getpid()

    assert beside(work, done.set, lambda *step: steps.append(step)) != os.getpid()
    assert steps == [("searching", 0.5)]
    assert done.is_set()


def test_kernels_of_the_copy_count_and_are_named_here():
    compiled = []

    def work(_):
        COMPILING.announce("separated")
        COMPILING.cpu_seconds += 2.0
        COMPILING.wall_seconds += 3.0

    before = COMPILING.cpu_seconds, COMPILING.wall_seconds
    with kernel_clock(compiled.append) as clock:
        beside(work, nothing, nothing)
        assert (clock.cpu_seconds, clock.wall_seconds) == pytest.approx((2.0, 3.0))
    assert compiled == ["separated"]
    COMPILING.cpu_seconds, COMPILING.wall_seconds = before


@pytest.mark.parametrize(
    ("error", "kind"),
    [(PlanError("no plan"), PlanError), (OSError(28, "No space left", "plan.json"), OSError)],
)
def test_what_the_copy_raises_is_raised_here_with_its_traceback(error, kind):
    def work(_):
        raise error

    with pytest.raises(kind, match=str(error.args[-1])) as raised:
        beside(work, nothing, nothing)
    assert "in work" in raised.value.__notes__[0]


def test_an_error_that_cannot_be_sent_keeps_its_message():
    def work(_):
        raise RefusalError("cells[3]", "is empty")

    with pytest.raises(Exception, match=r"cells\[3\]: is empty"):
        beside(work, nothing, nothing)


def test_a_copy_that_is_ended_is_an_error():
    with pytest.raises(ProcessError, match="the process that plans was ended"):
        beside(lambda _: os.kill(os.getpid(), signal.SIGKILL), nothing, nothing)


def test_the_copy_ends_with_this_process_s_interest():
    """As after Ctrl-C, which this process gets and the copy does not."""
    copies = []

    def interrupted(text, _):
        copies.append(int(text))
        raise KeyboardInterrupt

    def work(progress):
        progress(str(os.getpid()), 0.0)
        signal.pause()

    with pytest.raises(KeyboardInterrupt):
        beside(work, nothing, interrupted)
    with pytest.raises(ProcessLookupError):
        os.kill(copies[0], 0)
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, set())
