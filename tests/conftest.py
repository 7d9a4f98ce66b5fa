import gc
import os
import signal

import hypothesis
import pytest

# As in framerunner/cli.py: with several threads small matrices take ten times the processor time.
# It is read when numpy is imported, and inherited by programs that tests start.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def pytest_configure():
    """Find the same on a busy machine, and where a script started the tests in its background."""
    hypothesis.settings.register_profile("any machine", deadline=None)
    hypothesis.settings.load_profile("any machine")
    # A shell starts its background jobs with SIGINT ignored, and so would be all programs that tests start.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Do not look for garbage while the tests are imported, nor later in what was: it stays."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
