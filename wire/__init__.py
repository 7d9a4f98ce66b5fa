"""What crosses a link, as bytes and back: MAVLink, what an app tells of its mission, video over HTTP."""
