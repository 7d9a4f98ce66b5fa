"""A pymavlink script takes off and lands; the simulator's true state shows where the drone is."""

from pymavlink import mavutil

import framerunner

with framerunner.Simulator("open-field", speed=4) as simulator:
    simulator.wait_until_ready()
    drone = mavutil.mavlink_connection(simulator.drone_url.replace("://", ":"))
    drone.wait_heartbeat()

    def command(number: int, *values: float) -> int:
        drone.mav.command_long_send(
            drone.target_system, 1, number, 0, *values, *[float("nan")] * (7 - len(values))
        )
        return drone.recv_match(type="COMMAND_ACK", blocking=True, timeout=5).result

    ground_m = simulator.truth().position_arena_m[2]
    print("arm:", command(mavutil.mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1, 0))
    print("take off:", command(mavutil.mavlink.MAV_CMD_NAV_TAKEOFF))
    while simulator.truth().position_arena_m[2] < ground_m + 1.0:
        drone.recv_match(type="LOCAL_POSITION_NED", blocking=True, timeout=5)
    print(f"height: {simulator.truth().position_arena_m[2] - ground_m:.1f} m")
    print("land:", command(mavutil.mavlink.MAV_CMD_NAV_LAND))
