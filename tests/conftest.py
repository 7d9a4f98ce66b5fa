import signal


def pytest_configure():
    """A shell starts its background jobs deaf to Ctrl-C, and so would be all programs that tests start."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
