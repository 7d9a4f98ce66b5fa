"""A disk that takes no more."""

import resource
from contextlib import contextmanager


@contextmanager
def disk_that_takes(size):
    """No file of this process can grow beyond a size: the system refuses the write, as a full disk does."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
