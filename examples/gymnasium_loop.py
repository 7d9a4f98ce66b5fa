"""A loop of Gymnasium: a policy that climbs to a metre and turns until the red frame is in view."""

import gymnasium

import framerunner.gym

environment = gymnasium.make(framerunner.gym.ENVIRONMENT_ID, scenario="calm-17")
observation, info = environment.reset(seed=1)
for _ in range(400):
    climb = 1.0 - float(observation["imu"][2])
    action = [0.0, 0.0, max(-1.0, min(1.0, climb)), 0.5]  # forward, left, up, yaw rate to the left
    observation, reward, terminated, truncated, info = environment.step(action)
    if terminated or truncated or observation["seen"][0][1]:
        break
print(f"after {info['try_time_s']:.1f} s the red frame is {observation['cam'][0][4]:.2f} m away")
