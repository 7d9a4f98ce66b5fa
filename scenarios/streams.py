"""Random numbers from one seed, in named streams that do not know of each other.

A stream depends on the seed and its own name only, so one that is added, left out or drawn from more often
changes no other. Generator, seeding and hash are fixed here by name: what numpy or Python take by default may
change, the numbers may not.
"""

from __future__ import annotations

import hashlib

from numpy.random import PCG64, Generator, SeedSequence

from errors import UserError

MAX_SEED = 2**63 - 1  # fits the integers of every file format and database


class SeedError(UserError):
    """A seed out of range; the message is one line for people."""


def random_stream(seed: int, name: str) -> Generator:
    """Open a stream at its beginning.

    For numbers that must be the same everywhere, draw with `Generator.random()` and calculate in Python:
    numpy promises the other distributions neither through its versions (NEP 19) nor, to the last bit,
    through compilers.

    Args:
        seed: 0 to `MAX_SEED`.
        name: what the numbers are for, such as "layout.places".

    Raises:
        SeedError: the seed is out of range.
    """
    if not 0 <= seed <= MAX_SEED:
        raise SeedError(f"seed {seed} is out of range; use a whole number from 0 to {MAX_SEED}")
    digest = hashlib.blake2b(name.encode(), digest_size=16).digest()
    key = tuple(int.from_bytes(digest[at : at + 4], "little") for at in range(0, len(digest), 4))
    return Generator(PCG64(SeedSequence(int(seed), spawn_key=key)))
