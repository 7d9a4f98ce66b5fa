"""Where flights are flown: on this machine's cores, a Dask cluster or a Ray cluster, all through joblib."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import Any, Literal, get_args

from framerunner.errors import SettingError

Backend = Literal["loky", "dask", "ray"]
BACKENDS: tuple[Backend, ...] = get_args(Backend)
CONNECT_S = 10.0
_LOST_WORKER = {"BrokenProcessPool", "TerminatedWorkerError", "KilledWorker", "WorkerCrashedError"}
"""Errors by name: the clusters' packages may not be installed."""

Workers = Callable[[Iterable[Any]], Generator[Any, None, None]]
"""Takes joblib's delayed calls and yields what they return, in any order."""


@dataclass(frozen=True, slots=True)
class Pool:
    """Where flights are flown.

    Attributes:
        backend: see `BACKENDS`.
        jobs: how many at once on this machine; ignored by a cluster.
        address: of the cluster's scheduler, such as "tcp://10.0.0.1:8786".
    """

    backend: Backend = "loky"
    jobs: int = 1
    address: str | None = None


def check_pool(pool: Pool) -> None:
    """Raise a `SettingError` if the settings contradict each other."""
    if pool.backend not in BACKENDS:
        raise SettingError(f"--backend {pool.backend}: is not known; use {', '.join(BACKENDS)}")
    if pool.jobs < 1:
        raise SettingError(f"--jobs {pool.jobs}: must be 1 or more")
    if pool.backend == "dask" and pool.address is None:
        raise SettingError(
            "--backend dask: needs the scheduler's address, such as --address tcp://10.0.0.1:8786"
        )
    if pool.backend == "loky" and pool.address is not None:
        raise SettingError(f"--address {pool.address}: is for a cluster; add --backend dask or --backend ray")


def is_lost_worker(error: Exception) -> bool:
    """Whether a pool reports by this error that one of its processes died."""
    return any(kind.__name__ in _LOST_WORKER for kind in type(error).__mro__)


def open_pool(pool: Pool) -> AbstractContextManager[Workers]:
    """Start the workers or connect to them; the context stops or disconnects them.

    Raises:
        SettingError: no cluster answers at the address.
        ModuleNotFoundError: a package is not installed; see `extras.install_advice`.
    """
    return {"loky": _loky, "dask": _dask, "ray": _ray}[pool.backend](pool)


@contextmanager
def _loky(pool: Pool) -> Iterator[Workers]:
    from joblib import parallel_config

    with parallel_config(backend="loky", n_jobs=pool.jobs, inner_max_num_threads=1):
        yield _streaming


@contextmanager
def _dask(pool: Pool) -> Iterator[Workers]:
    from distributed import Client
    from joblib import parallel_config

    try:
        client = Client(pool.address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split()) or "no answer"
        raise SettingError(f"--address {pool.address}: no Dask scheduler there ({reason:.120})") from None
    with client:
        if not client.ncores():
            raise SettingError(
                f"--address {pool.address}: the scheduler has no workers; start some: dask worker"
            )
        with parallel_config(backend="dask", client=client):
            yield _streaming


@contextmanager
def _ray(pool: Pool) -> Iterator[Workers]:
    import ray
    from joblib import parallel_config
    from ray.util.joblib import register_ray

    try:
        ray.init(address=pool.address, log_to_driver=False)
    except ConnectionError as error:
        raise SettingError(f"--address {pool.address}: no Ray cluster there ({error!s:.120})") from None
    try:
        register_ray()
        with parallel_config(backend="ray", n_jobs=-1):
            yield _in_batches
    finally:
        ray.shutdown()


def _streaming(calls: Iterable[Any]) -> Generator[Any, None, None]:
    from joblib import Parallel

    parallel = Parallel(return_as="generator_unordered", batch_size=1, pre_dispatch="2*n_jobs")
    rows: Generator[Any, None, None] = parallel(calls)
    return rows


def _in_batches(calls: Iterable[Any]) -> Generator[Any, None, None]:
    """For a backend that returns its results only when all are done."""
    from joblib import Parallel, effective_n_jobs

    calls = iter(calls)
    while batch := list(islice(calls, 4 * effective_n_jobs())):
        yield from Parallel(batch_size=1)(batch)
