"""Packages that a small installation leaves out, and how to get them."""

from __future__ import annotations

from importlib.util import find_spec

_EXTRAS = {
    "av": "video",
    "fastapi": "monitor",
    "ifaddr": "monitor",
    "matplotlib": "plots",
    "multipart": "monitor",
    "nicegui": "monitor",
    "PIL": "video",
    "segno": "monitor",
    "sqlalchemy": "monitor",
    "starlette": "monitor",
    "uvicorn": "monitor",
}


def is_installed(module: str) -> bool:
    """Whether a module of an extra can be imported, without importing it."""
    return find_spec(module) is not None


def advice(module: str) -> str | None:
    """Return what is missing and the command that installs it, as one clause for people.

    Args:
        module: what could not be imported, such as "nicegui" or "matplotlib.figure".

    Returns:
        None if no extra of this project brings the module.
    """
    package = module.partition(".")[0]
    extra = _EXTRAS.get(package)
    return None if extra is None else f"{package} is not installed; pip install 'framerunner[{extra}]'"
