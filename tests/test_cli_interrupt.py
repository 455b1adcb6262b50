"""Processes of a command: Ctrl-C ends it at once with whole files."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time

import pytest
import typer

from coop_drake.answers import load_plan
from coop_drake.cli.reporter import reporting
from coop_drake.errors import PlanError, RefusalError, transferable
from coop_drake.interrupts import uninterrupted
from tests.support.scenarios import MODELS

# A shell that starts tests in the background has its children ignore Ctrl-C.
RESULTS = [".coop_drake_results.json", "plan.json", "table_1.md"]
INTERRUPTIBLE = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from coop_drake import entry_point
entry_point._PATIENCE = 300.0  # A busy machine may need longer than the two seconds that are promised.
entry_point.main()
"""


@pytest.mark.slow
def test_ctrl_c_after_planning_leaves_the_plan_whole_and_nothing_half_written(tmp_path):
    command = [sys.executable, "-c", INTERRUPTIBLE]
    command += ["run", str(MODELS / "base.scenario.yaml"), "--out", str(tmp_path), "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while process.poll() is None and not (tmp_path / "table_1.md").exists():
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate()
    assert process.returncode == 130, stderr
    assert "interrupted" in json.loads(stdout)["error"]
    assert "Traceback" not in stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == RESULTS
    assert load_plan(tmp_path / "plan.json").cells


def _ended(error: BaseException) -> int:
    """Exit code of a command that raises an error."""
    with pytest.raises(typer.Exit) as left, reporting(quiet=True):
        raise error
    return left.value.exit_code


def test_a_missing_package_is_answered_with_the_extra_that_installs_it(capsys):
    assert _ended(ModuleNotFoundError("No module named 'trimesh'", name="trimesh")) == 2
    assert "pip install 'defusedxml>=0.7' 'pycollada>=0.8' 'trimesh>=4.5'" in " ".join(
        capsys.readouterr().err.split()
    )
    with pytest.raises(ModuleNotFoundError):
        _ended(ModuleNotFoundError("No module named 'kma'", name="kma"))


def test_ctrl_c_inside_compiled_code_and_imports_is_no_bug(capsys):
    for error in (SystemError("a result with an exception set"), ImportError("initialization failed")):
        error.__cause__ = KeyboardInterrupt()
        assert _ended(error) == 130
        assert "interrupted" in capsys.readouterr().err
    with pytest.raises(SystemError, match="of another kind"):
        _ended(SystemError("of another kind"))


# However busy the machine is, the signal comes when compiled code has used some time of the processor.
IN_COMPILED_CODE = """
import hashlib, os, signal, sys, threading, time, types
signal.signal(signal.SIGINT, signal.default_int_handler)
from coop_drake import entry_point
def interrupt():
    while time.process_time() < begin + 0.1:
        time.sleep(0.01)
    os.kill(os.getppid(), signal.SIGINT)  # The process that was started; the command works in another.
def command_line():
    global begin
    begin = time.process_time()
    threading.Thread(target=interrupt).start()
    hashlib.pbkdf2_hmac("sha256", b"", b"", 200_000_000)  # a minute without Python
sys.modules["coop_drake.cli"] = types.SimpleNamespace(main=command_line)
entry_point.main()
"""

# A library that holds Python's lock: no thread of this process can answer a signal.
WITH_THE_LOCK = """
import ctypes, os, signal, sys, types
signal.signal(signal.SIGINT, signal.default_int_handler)
from coop_drake import entry_point
def command_line():
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    os.kill(os.getppid(), signal.SIGINT)
    ctypes.PyDLL(None).sleep(60)
sys.modules["coop_drake.cli"] = types.SimpleNamespace(main=command_line)
entry_point.main()
"""

# The signal comes when the entry point imports the first module of the command line.
IN_THE_FIRST_IMPORT = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from coop_drake import entry_point
class Interrupting:
    def find_spec(self, name, path, target=None):
        if name == "coop_drake.cli":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupting())
entry_point.main()
"""


@pytest.mark.parametrize(
    "program", [IN_COMPILED_CODE, WITH_THE_LOCK, IN_THE_FIRST_IMPORT], ids=["compiled", "lock", "import"]
)
def test_ctrl_c_ends_compiled_code_and_the_first_imports(program):
    done = subprocess.run(
        [sys.executable, "-c", program, "plan", str(MODELS / "base.scenario.yaml")], capture_output=True
    )
    assert done.returncode == 130
    assert done.stderr.decode() == "Error: interrupted; files already written are whole\n"


COMMAND = """
sys.modules["coop_drake.cli"] = types.SimpleNamespace(main=command_line)
entry_point.main()
"""

WAITING = """
import os, sys, time, types
from coop_drake import entry_point
def command_line():
    os.write(1, b"ready")
    time.sleep(60)
sys.modules["coop_drake.cli"] = types.SimpleNamespace(main=command_line)
entry_point.main()
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_command_that_is_ended_from_outside_leaves_no_process_behind(number):
    interruptible = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    with subprocess.Popen([sys.executable, "-c", interruptible + WAITING], stdout=subprocess.PIPE) as process:
        assert process.stdout.read(5) == b"ready"
        process.send_signal(number)
        assert process.wait() == -number
        assert process.stdout.read() == b""  # It ends when no process can write any more.


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV])
def test_a_command_ends_by_the_signal_that_ends_its_work(number):
    work = f"def command_line():\n    print('begun', flush=True)\n    os.kill(os.getpid(), {number})\n"
    program = "import os, sys, types\nfrom coop_drake import entry_point\n" + work + COMMAND
    done = subprocess.run([sys.executable, "-c", program], capture_output=True)
    assert (done.returncode, done.stdout, done.stderr) == (-number, b"begun\n", b"")


@pytest.mark.parametrize("action", ["SIG_IGN", "default_int_handler"])
def test_what_a_command_prints_is_whole_in_a_pipe(action):
    begin = f"import signal, sys, types\nsignal.signal(signal.SIGINT, signal.{action})\n"
    work = "from coop_drake import entry_point\ndef command_line():\n    print('all')\n"
    program = begin + work + COMMAND
    done = subprocess.run([sys.executable, "-c", program], capture_output=True)
    assert (done.returncode, done.stdout) == (0, b"all\n")


@pytest.mark.parametrize(
    ("error", "kind"),
    [(PlanError("no plan"), PlanError), (OSError(28, "No space left", "plan.json"), OSError)],
)
def test_an_error_of_another_process_keeps_its_kind_and_its_traceback(error, kind):
    def work():
        raise error

    with pytest.raises(kind) as raised:
        work()
    sent = transferable(raised.value)
    assert type(sent) is kind
    assert sent.args == error.args
    assert "in work" in sent.__notes__[0]


def test_an_error_that_cannot_be_sent_keeps_its_message():
    assert str(transferable(RefusalError("cells[3]", "is empty"))) == "cells[3]: is empty"


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
