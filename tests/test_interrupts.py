"""Ctrl-C waits while a process is started, and is answered afterwards."""

import os
import signal
import threading

import pytest

from coop_drake.interrupts import uninterrupted


@pytest.fixture
def received():
    """A pipe that can be read when a signal has been received, by a thread that does nothing else."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    # A shell that starts tests in the background has them ignore Ctrl-C.
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    before, over = signal.set_wakeup_fd(writer), threading.Event()
    other = threading.Thread(target=over.wait, daemon=True)
    other.start()
    yield reader
    over.set()
    other.join()
    signal.set_wakeup_fd(before)
    signal.signal(signal.SIGINT, handler)
    os.close(reader)
    os.close(writer)


def test_ctrl_c_that_another_thread_receives_waits_for_the_end_of_the_block(received):
    over = False
    with pytest.raises(KeyboardInterrupt), uninterrupted():  # noqa: PT012
        os.kill(os.getpid(), signal.SIGINT)
        assert os.read(received, 1) == bytes([signal.SIGINT])
        over = True
    assert over
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_nothing_is_left_of_a_block_without_ctrl_c():
    before = signal.getsignal(signal.SIGINT), signal.pthread_sigmask(signal.SIG_BLOCK, ())
    with uninterrupted():
        assert signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())
    assert before == (signal.getsignal(signal.SIGINT), signal.pthread_sigmask(signal.SIG_BLOCK, ()))
