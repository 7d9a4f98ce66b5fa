"""What crosses a link, as bytes and back: MAVLink, an app's reports of its mission, video over HTTP."""
