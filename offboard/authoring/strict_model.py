"""The base of data that comes from outside: pages, and files beside missions."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class StrictModel(BaseModel):
    """Cannot be changed, and has no fields but its own."""

    model_config = ConfigDict(frozen=True, extra="forbid")
