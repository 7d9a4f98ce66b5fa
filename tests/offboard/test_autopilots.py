"""Which autopilot it is decides what its response is expected to be."""

from types import SimpleNamespace

import pytest
from mavsdk.asyncio import MavsdkError

from framerunner.wire.vehicle_identity import simulator_uid
from offboard.link.autopilots import is_own_autopilot


@pytest.mark.parametrize(("uid", "own"), [(simulator_uid(1), True), (simulator_uid(2), False), (77, False)])
async def test_our_own_autopilot_is_known_by_its_identity_when_that_has_been_received(uid, own):
    answers = iter([MavsdkError("INFORMATION_NOT_RECEIVED_YET"), SimpleNamespace(legacy_uid=uid)])

    async def get_identification():
        answer = next(answers)
        if isinstance(answer, Exception):
            raise answer
        return answer

    assert await is_own_autopilot(SimpleNamespace(get_identification=get_identification), 1) is own
