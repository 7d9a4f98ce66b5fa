"""What a simulated drone carries: the storage of its camera, gimbal and gripper."""
