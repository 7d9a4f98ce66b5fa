"""What to say to a user whose installation lacks a package."""

from __future__ import annotations

from importlib.util import find_spec

_EXTRAS = {
    "av": "video",
    "distributed": "dask",
    "fastapi": "monitor",
    "ifaddr": "monitor",
    "mcap": "recording",
    "motioncapture": "mocap",
    "multipart": "monitor",
    "PIL": "video",
    "ray": "ray",
    "segno": "monitor",
    "sqlalchemy": "monitor",
    "starlette": "monitor",
    "uvicorn": "monitor",
    "zstandard": "recording",
}


def is_installed(module: str) -> bool:
    """Whether a top-level module can be imported, without importing it."""
    return find_spec(module) is not None


def install_advice(module: str) -> str | None:
    """The command that installs a missing module such as "matplotlib.figure", as one clause for people.

    None if the module is in none of this project's extras, nor left out on this processor.
    """
    package = module.partition(".")[0]
    if package == "jsbsim":
        return (
            "jsbsim is not installed: the registry has none for this processor, so nothing can be simulated "
            "here; simulate on another computer, or build it (pip install jsbsim, needs CMake and a compiler)"
        )
    extra = _EXTRAS.get(package)
    return None if extra is None else f"{package} is not installed; pip install 'framerunner[{extra}]'"
