"""The map and the plan of an app's navigator: its MAP document, and the message for the pages."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from framerunner.wire.status_text import plain

_Metres = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
_Deviation = Annotated[float, Field(ge=0, le=1000, allow_inf_nan=False)]
_Radians = Annotated[float, Field(ge=-7, le=7, allow_inf_nan=False)]
_Point = tuple[_Metres, _Metres, _Metres]
_Text = Annotated[str, Field(max_length=80)]


class _Part(BaseModel):
    """Other fields than those below are left out, so that newer apps can send more."""

    model_config = ConfigDict(extra="ignore", frozen=True)


class _MappedFrame(_Part):
    """A frame as estimated; a standard deviation that is not known is None."""

    colour: _Text
    p: _Point
    yaw: _Radians
    std: tuple[_Deviation, _Deviation, _Deviation] | None = None
    yaw_std: _Deviation | None = None
    certain: bool = False
    ambiguous: bool = False
    views: int = Field(0, ge=0, le=2**31)


class NavigationDocument(_Part):
    """The MAP document."""

    mission_crc: int = Field(0, ge=0, lt=2**32)
    time_us: int = Field(0, ge=0, le=2**53)
    goal: _Text = ""
    frames: list[_MappedFrame] = Field([], max_length=50)
    path: list[_Point] = Field([], max_length=100)


def map_message(drone_id: int, document: NavigationDocument) -> dict[str, Any]:
    """The message "map"; its texts come from outside."""
    content = document.model_dump(mode="json", exclude={"mission_crc", "time_us"})
    for frame in content["frames"]:
        frame["colour"] = plain(frame["colour"])
    known = {**content, "goal": plain(document.goal), "t": round(document.time_us * 1e-6, 3)}
    return {"kind": "map", "id": drone_id, **known}
