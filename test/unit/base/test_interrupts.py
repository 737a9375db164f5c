"""Where Ctrl-C arrives."""

import signal
import subprocess
import sys
import threading

import pytest

from diff_encoder_sim.base.processes import interrupts_blocked


def blocked():
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_it_waits_until_the_end_of_the_context():
    passed = []
    with pytest.raises(KeyboardInterrupt):
        with interrupts_blocked():
            signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
            passed.append('the context')
    assert passed and not blocked()


def test_threads_and_processes_of_the_context_never_get_it():
    seen = []
    ask = 'import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))'
    with interrupts_blocked():
        thread = threading.Thread(target=lambda: seen.append(blocked()))
        thread.start()
        process = subprocess.run([sys.executable, '-c', ask], capture_output=True, text=True)
    thread.join()
    assert (seen, process.stdout) == ([True], 'True\n')
