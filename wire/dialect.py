"""The one place that chooses the message definitions.

pymavlink's `development` dialect is `common` and the few newer messages that PX4 sends, such as CURRENT_MODE
and AVAILABLE_MODES; it loads as quickly as `common`. No other module names a dialect. The messages of
`common` that pymavlink has left out are added to it here.
"""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import development as mavlink

from wire import extra_messages

Message = Any  # a pymavlink message; its classes are made at run time and carry no types

AUTOPILOT_COMPONENT_ID = 1
BROADCAST = 0

__all__ = ["AUTOPILOT_COMPONENT_ID", "BROADCAST", "Message", "mavlink"]

_own = vars(mavlink)
mavlink.mavlink_map.update(extra_messages.mavlink_map | mavlink.mavlink_map)
_own.update({name: value for name, value in vars(extra_messages).items() if name not in _own})
