"""What an app tells of its mission over MAVLink, as bytes and back; see `docs/monitor-channels.md`."""
