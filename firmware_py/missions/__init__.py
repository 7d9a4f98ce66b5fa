"""Missions, fences and rally points: what was uploaded, whether it makes sense, and how it is flown.

Nothing here knows MAVLink's messages; `firmware_py.mavlink.missions.protocol` fills the store.
"""
