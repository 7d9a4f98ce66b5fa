"""The pages of the monitor, one module each, and the frame they share."""
