"""The state-space stabiliser: model, design, mixer, control law."""
