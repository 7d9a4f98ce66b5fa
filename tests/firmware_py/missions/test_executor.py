from math import dist, hypot, isnan, nan, radians

import pytest

from firmware_py.missions.flight import LegKind
from firmware_py.missions.items import Do, PlanType
from firmware_py.parameters import Parameters
from tests.firmware_py.missions.mission_world import World, doing, placed, plan, waypoint


def test_a_mission_of_waypoints_is_climbed_to_and_flown_in_order():
    world = World(plan(waypoint(0, 20, 10), waypoint(30, 20, 12), waypoint(30, 0, 5)))
    leg = world.run()
    assert world.kinds[0] is LegKind.TAKEOFF
    assert world.legs[0].target_ned_m == pytest.approx((0.0, 0.0, -10.0), abs=1e-6)
    assert world.reached == [0, 1, 2]
    assert leg.kind is LegKind.DONE
    assert leg.target_ned_m == pytest.approx((30.0, 0.0, -5.0), abs=1e-3)
    assert world.store.finished
    assert world.store.current == 2
    assert world.texts == [
        "Executing Mission",
        "Climb to 10.0 meters above home",
        "Mission finished, loitering",
    ]


def test_a_take_off_item_climbs_straight_up_and_then_flies_to_its_place():
    world = World(plan(placed(Do.TAKEOFF, 5, 5, 10), waypoint(20, 0, 10)))
    world.run(until=lambda world: world.legs[-1].kind is not LegKind.TAKEOFF)
    assert world.view.position_ned_m[:2] == pytest.approx((0.0, 0.0), abs=0.1)
    assert -world.view.position_ned_m[2] >= 10.0 - 0.8 - 0.1
    assert world.reached == []  # the climb alone does not count
    world.run()
    assert world.reached == [0, 1]


def test_legs_continue_without_a_stop_unless_an_item_waits():
    world = World(
        plan(
            waypoint(0, 20, 10),
            doing(Do.CHANGE_SPEED, 1, 3),
            waypoint(20, 20, 10),
            doing(Do.DELAY, 1),
            waypoint(0, 0, 10),
        )
    )
    world.run()
    flown = [leg for leg in world.legs if leg.kind is LegKind.FLY]
    first = next(leg for leg in flown if dist(leg.target_ned_m, (0, 20, -10)) < 0.01)
    second = next(leg for leg in flown if dist(leg.target_ned_m, (20, 20, -10)) < 0.01)
    last = flown[-1]
    assert first.next_ned_m == pytest.approx((20, 20, -10), abs=1e-3)
    assert second.next_ned_m is None
    assert last.next_ned_m is None


def test_an_item_s_radius_and_hold_time_count():
    world = World(plan(waypoint(0, 50, 10, params=(4.0, 8.0, 0.0, nan)), waypoint(0, 60, 10)))
    world.run(until=lambda world: world.legs[-1].kind is LegKind.FLY)
    leg = world.legs[-1]
    assert (leg.radius_m, leg.next_ned_m) == (8.0, None)
    world.run(until=lambda world: world.view.position_ned_m[1] > 42.0)
    arrived_us = world.view.time_us
    world.run(until=lambda world: world.reached == [0])
    assert world.view.time_us - arrived_us == pytest.approx(4e6, abs=60_000)


def test_the_heading_of_a_waypoint_is_waited_for():
    items = plan(waypoint(0, 10, 10, params=(0.0, 0.0, 0.0, 270.0)), waypoint(0, 0, 10))
    world = World(items)
    world.view.yaw_rad = radians(90)
    world.run(until=lambda world: world.reached == [0])
    assert abs(world.view.yaw_rad % radians(360) - radians(270)) < radians(12.1)
    forgiving = World(items, parameters=Parameters({"MIS_YAW_TMT": 1.0}))
    forgiving.view.yaw_rad = radians(90)
    forgiving.run(until=lambda world: world.reached == [0])
    assert forgiving.view.time_us < world.view.time_us


def test_delay_waits_in_place():
    world = World(plan(waypoint(0, 10, 10), doing(Do.DELAY, 5), waypoint(0, 30, 10)))
    world.run(until=lambda world: world.store.current == 1)
    began_us = world.view.time_us
    world.run(until=lambda world: world.store.current == 2)
    assert world.view.time_us - began_us == pytest.approx(5e6, abs=60_000)
    assert hypot(world.view.position_ned_m[0], world.view.position_ned_m[1] - 10) < 2.0


@pytest.mark.parametrize("hold_s", [-1.0, nan, 0.0])
def test_an_invalid_delay_is_ignored(hold_s):
    world = World(plan(waypoint(0, 10, 10), doing(Do.DELAY, hold_s), waypoint(0, 30, 10)))
    world.run()
    assert world.reached == [0, 1, 2]


def test_speed_changes_hold_until_the_next():
    world = World(
        plan(
            waypoint(0, 10, 10),
            doing(Do.CHANGE_SPEED, 1, 2.5, -1),
            waypoint(0, 20, 10),
            doing(Do.CHANGE_SPEED, 1, 0, -1),
            waypoint(0, 30, 10),
        )
    )
    world.run()
    speeds = {}
    for leg in world.legs:
        speeds.setdefault(round(leg.target_ned_m[1]), leg.speed_m_s)
    assert speeds[20] == 2.5
    assert isnan(speeds[30])


@pytest.mark.parametrize("repeats", [0, 1, 3])
def test_a_jump_is_followed_as_often_as_it_says(repeats):
    world = World(
        plan(waypoint(0, 10, 10), waypoint(0, 20, 10), doing(Do.JUMP, 0, repeats), waypoint(0, 30, 10))
    )
    world.run()
    assert world.reached == [0, 1] * (repeats + 1) + [3]


def test_a_jump_at_the_end_ends_the_mission_when_used_up():
    world = World(plan(waypoint(0, 10, 10), waypoint(0, 20, 10), doing(Do.JUMP, 0, 1)))
    assert world.run().kind is LegKind.DONE
    assert world.reached == [0, 1, 0, 1]
    assert world.store.finished


def test_a_loop_of_jumps_ends_the_mission():
    world = World(plan(waypoint(0, 10, 10), doing(Do.JUMP, 2, -1), doing(Do.JUMP, 1, -1)))
    assert world.run().kind is LegKind.DONE


def test_landing_flies_there_first_and_ends_on_the_ground():
    world = World(plan(waypoint(0, 10, 10), placed(Do.LAND, 20, 10, 0)))
    leg = world.run()
    assert world.kinds == [LegKind.TAKEOFF, LegKind.FLY, LegKind.FLY, LegKind.LAND, LegKind.DONE]
    approach, landing = world.legs[2], world.legs[3]
    assert approach.target_ned_m == pytest.approx((20, 10, -10), abs=1e-3)
    assert landing.target_ned_m[:2] == pytest.approx((20, 10), abs=1e-3)
    assert leg.kind is LegKind.DONE and world.view.landed
    assert world.texts[-1] == "Mission finished, landed"


def test_a_return_item_switches_to_return_mode_and_completes():
    world = World(plan(waypoint(0, 10, 10), doing(Do.RETURN_TO_LAUNCH)))
    assert world.run().kind is LegKind.RETURN
    assert world.reached == [0, 1]
    assert world.store.finished
    assert world.executor.step(world.view).kind is LegKind.RETURN


def test_loiter_items():
    world = World(
        plan(
            waypoint(0, 10, 10),
            placed(Do.LOITER_TIME, 0, 20, 10, params=(3.0, 0.0, 0.0, nan)),
            placed(Do.LOITER_TO_ALT, 0, 40, 25, params=(0.0, 5.0, 0.0, 0.0)),
            placed(Do.LOITER_UNLIM, 0, 60, 25),
        )
    )
    world.run(120.0, until=lambda world: world.store.current == 2)
    assert -world.view.position_ned_m[2] < 11.0
    world.run(120.0, until=lambda world: world.store.current == 3)
    assert -world.view.position_ned_m[2] >= 25.0 - 0.8 - 0.1
    leg = world.run(60.0)
    assert leg.kind is LegKind.FLY and world.store.current == 3 and not world.store.finished
    assert world.reached == [0, 1, 2]
    assert dist(world.view.position_ned_m, (0, 60, -25)) < 0.1


def test_a_region_of_interest_is_looked_at_until_released():
    world = World(
        plan(
            waypoint(0, 10, 10),
            placed(Do.SET_ROI_LOCATION, 100, 10, 0),
            waypoint(0, 40, 10),
            doing(Do.SET_ROI_NONE),
            waypoint(0, 80, 10),
        )
    )
    world.run(until=lambda world: world.reached[-1:] == [2])
    yaws = [leg.yaw_rad for leg in world.legs if not isnan(leg.yaw_rad)]
    assert yaws[0] == pytest.approx(radians(0), abs=radians(5))
    assert yaws[-1] == pytest.approx(radians(-16.7), abs=radians(3))  # from (0, 40) to (100, 10)
    world.run()
    assert isnan(world.legs[-2].yaw_rad)


def test_camera_items_reach_the_camera():
    world = World(
        plan(
            waypoint(0, 10, 10),
            doing(Do.IMAGE_START_CAPTURE, 0, 2.0, 5),
            doing(Do.IMAGE_STOP_CAPTURE),
            doing(Do.SET_CAM_TRIGG_INTERVAL, 500),
            doing(Do.GIMBAL_PITCHYAW, -45),
            doing(Do.VIDEO_START_CAPTURE, 0, 1),
            waypoint(0, 20, 10),
        )
    )
    world.run()
    assert [command for command, _ in world.commands] == [2000, 2001, 2000, 1000, 2500]
    assert world.commands[0][1][:3] == (0, 2.0, 5)
    assert world.commands[2][1][:3] == (0, 0.5, 0)
    world.executor.leave()
    world.collect()
    assert world.commands[-1][0] == 2001  # pictures by time stop when the mission is left


def test_pictures_by_distance():
    world = World(
        plan(
            waypoint(0, 10, 10),
            doing(Do.SET_CAM_TRIGG_DIST, 5, 0, 1),
            waypoint(0, 41, 10),
            doing(Do.SET_CAM_TRIGG_DIST, 0),
            waypoint(0, 80, 10),
        )
    )
    world.run()
    assert [command for command, _ in world.commands] == [2000] * 7  # at once, and each 5 m of 31 m
    assert [params[2:4] for _, params in world.commands] == [(1.0, float(n)) for n in range(1, 8)]


def test_items_for_missing_devices_are_skipped_with_a_text():
    world = World(plan(waypoint(0, 10, 10), doing(Do.WINCH, 1, 0), waypoint(0, 20, 10)))
    world.run()
    assert "Mission item 2 does nothing: no such device here" in world.texts
    assert world.reached == [0, 1, 2]


def test_home_and_arming_items_are_passed_on():
    world = World(plan(waypoint(0, 10, 10), doing(Do.SET_HOME, 1), doing(Do.ARM_DISARM, 0)))
    world.run()
    assert [command for command, _ in world.commands] == [Do.SET_HOME, Do.ARM_DISARM]


def test_a_gate_is_passed_on_the_way():
    world = World(plan(waypoint(0, 0, 10), placed(Do.CONDITION_GATE, 0, 20, 10), waypoint(0, 40, 10)))
    world.run(until=lambda world: world.reached[-1:] == [1])
    assert world.view.position_ned_m[1] == pytest.approx(20.0, abs=0.5)
    world.run()
    assert world.reached == [0, 1, 2]


def test_pause_and_resume_fly_the_same_item_again():
    world = World(
        plan(waypoint(0, 20, 10), doing(Do.CHANGE_SPEED, 1, 2), waypoint(0, 60, 10), waypoint(0, 80, 10))
    )
    world.run(until=lambda world: world.view.position_ned_m[1] > 30)
    world.executor.leave()
    assert world.store.current == 2 and not world.store.finished
    world.view.time_us += 5_000_000
    world.executor.enter(world.view)
    leg = world.tick()
    assert leg.kind is LegKind.FLY
    assert leg.target_ned_m == pytest.approx((0, 60, -10), abs=1e-3)
    assert leg.speed_m_s == 2.0
    world.run()
    assert world.reached == [0, 1, 2, 3]


def test_resuming_pictures_goes_back_to_the_last_place():
    world = World(
        plan(
            waypoint(0, 20, 10),
            doing(Do.SET_CAM_TRIGG_DIST, 5, 0, 0),
            waypoint(0, 60, 10),
            waypoint(0, 80, 10),
        )
    )
    world.run(until=lambda world: world.view.position_ned_m[1] > 41)
    world.executor.leave()
    world.commands.clear()
    world.executor.enter(world.view)
    assert world.store.current == 0
    world.run()
    assert world.reached == [0, 1, 0, 1, 2, 3]
    assert len(world.commands) >= 11


def test_choosing_an_item_in_flight_jumps_there():
    world = World(plan(waypoint(0, 20, 10), waypoint(0, 60, 10), waypoint(0, 80, 10)))
    world.run(until=lambda world: world.view.position_ned_m[1] > 10)
    assert world.store.select(2)
    assert world.tick().target_ned_m == pytest.approx((0, 80, -10), abs=1e-3)
    world.run()
    assert world.reached == [2]
    assert not world.store.select(3)


def test_a_new_mission_in_flight_continues_at_the_same_index_or_the_marked_one():
    first = plan(waypoint(0, 20, 10), waypoint(0, 60, 10), waypoint(0, 80, 10))
    second = plan(waypoint(5, 20, 10), waypoint(5, 60, 10), waypoint(5, 80, 10))
    for current, expected in [(None, 60), (0, 20)]:
        world = World(first)
        world.run(until=lambda world: world.view.position_ned_m[1] > 30)
        world.store.replace(PlanType.MISSION, second, current=current)
        world.store.valid = True
        assert world.tick().target_ned_m == pytest.approx((5, expected, -10), abs=1e-3)


def test_the_same_mission_again_changes_nothing():
    items = plan(waypoint(0, 20, 10), waypoint(0, 60, 10))
    world = World(items)
    world.run(until=lambda world: world.reached == [0])
    before = world.executor.step(world.view)
    world.store.replace(PlanType.MISSION, items, current=0)
    assert world.executor.step(world.view) is before


def test_a_cleared_mission_holds():
    world = World(plan(waypoint(0, 20, 10), waypoint(0, 60, 10)))
    world.run(until=lambda world: world.view.position_ned_m[1] > 10)
    world.store.clear(PlanType.MISSION)
    assert world.tick().kind is LegKind.DONE
    assert world.texts[-1] == "No valid mission available, loitering"


def test_without_a_valid_mission_there_is_a_text_and_no_flight():
    world = World([])
    assert world.tick().kind is LegKind.DONE
    assert world.texts == ["No valid mission available, refusing takeoff"]


def test_after_disarming_a_finished_mission_and_its_jumps_begin_again():
    world = World(
        plan(
            waypoint(0, 10, 10),
            waypoint(0, 5, 10),
            doing(Do.JUMP, 0, 1),
            placed(Do.LAND, 0, 0, 0),
        )
    )
    world.run()
    once = list(world.reached)
    assert once == [0, 1, 0, 1, 3]
    world.executor.leave()
    world.executor.disarmed()
    world.executor.enter(world.view)
    world.run()
    assert world.reached == once * 2


def test_without_autocontinue_the_mission_waits():
    world = World(plan(waypoint(0, 10, 10, autocontinue=False), waypoint(0, 20, 10)))
    leg = world.run(60.0)
    assert (leg.kind, leg.next_ned_m) == (LegKind.FLY, None)
    assert world.reached == [0]
    assert not world.store.finished


def test_an_altitude_that_is_not_given_is_the_present_one():
    world = World(plan(waypoint(0, 10, 10), waypoint(0, 40, nan)))
    leg = world.run()
    assert leg.target_ned_m == pytest.approx((0, 40, -10), abs=1e-3)


def test_heights_move_with_home():
    world = World(plan(waypoint(0, 10, 10), waypoint(0, 60, 10)))
    world.run(until=lambda world: world.reached == [0])
    world.view.home_ned_m = (0.0, 0.0, -3.0)
    assert world.tick().target_ned_m == pytest.approx((0, 60, -13), abs=1e-3)


def test_a_step_without_changes_gives_the_same_leg():
    world = World(plan(waypoint(0, 100, 10), waypoint(0, 200, 10)))
    world.run(until=lambda world: world.view.position_ned_m[1] > 50)
    assert world.tick() is world.tick()
