"""Who flies: this machine's cores, a Dask cluster or a Ray cluster, all through joblib."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import Any, Literal, get_args

from errors import SettingError

Backend = Literal["loky", "dask", "ray"]
BACKENDS: tuple[Backend, ...] = get_args(Backend)
CONNECT_S = 10.0
_LOST_WORKER = {"BrokenProcessPool", "TerminatedWorkerError", "KilledWorker", "WorkerCrashedError"}
"""Names, not classes: those of clusters may not be installed."""

Workers = Callable[[Iterable[Any]], Generator[Any, None, None]]
"""Takes joblib's delayed calls and gives what they return, in any order, as it comes."""


@dataclass(frozen=True, slots=True)
class Pool:
    """Where flights are flown.

    Attributes:
        backend: see `BACKENDS`.
        jobs: how many at once on this machine; a cluster knows that itself.
        address: of the cluster's scheduler, such as "tcp://10.0.0.1:8786".
    """

    backend: Backend = "loky"
    jobs: int = 1
    address: str | None = None

    @property
    def in_process(self) -> bool:
        """No other process is needed."""
        return self.backend == "loky" and self.jobs == 1


def check_pool(pool: Pool) -> None:
    """Refuse settings that do not go together, before anything is done.

    Raises:
        SettingError: naming the option.
    """
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
    """Whether a process that flew has died, as the pools tell it."""
    return any(kind.__name__ in _LOST_WORKER for kind in type(error).__mro__)


def open_pool(pool: Pool) -> AbstractContextManager[Workers]:
    """Start or reach the workers; they are let go at the end.

    Raises:
        SettingError: a package is not installed, or nobody answers at the address.
    """
    makers = {"loky": _loky, "dask": _dask, "ray": _ray}
    return makers[pool.backend](pool)


@contextmanager
def _loky(pool: Pool) -> Iterator[Workers]:
    from joblib import parallel_config

    with parallel_config(backend="loky", n_jobs=pool.jobs, inner_max_num_threads=1):
        yield _streaming


@contextmanager
def _dask(pool: Pool) -> Iterator[Workers]:
    try:
        from distributed import Client
    except ImportError:
        raise _not_installed("dask") from None
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
    try:
        import ray
        from ray.util.joblib import register_ray
    except ImportError:
        raise _not_installed("ray") from None
    from joblib import parallel_config

    try:
        ray.init(address=pool.address, log_to_driver=False)
    except ConnectionError as error:
        raise SettingError(f"--address {pool.address}: no Ray cluster there ({error!s:.120})") from None
    try:
        register_ray()
        with parallel_config(backend="ray", n_jobs=-1):
            yield _in_portions
    finally:
        ray.shutdown()


def _streaming(calls: Iterable[Any]) -> Generator[Any, None, None]:
    from joblib import Parallel

    parallel = Parallel(return_as="generator_unordered", batch_size=1, pre_dispatch="2*n_jobs")
    rows: Generator[Any, None, None] = parallel(calls)
    return rows


def _in_portions(calls: Iterable[Any]) -> Generator[Any, None, None]:
    """For a backend that gives its results only when all are there."""
    from joblib import Parallel, effective_n_jobs

    calls = iter(calls)
    while portion := list(islice(calls, 4 * effective_n_jobs())):
        yield from Parallel(batch_size=1)(portion)


def _not_installed(backend: str) -> SettingError:
    return SettingError(f"--backend {backend}: is not installed; pip install 'framerunner[{backend}]'")
