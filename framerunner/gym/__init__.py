"""The frame challenge as an environment of Gymnasium: import this package, then make `FrameChallenge-v0`."""

try:
    from gymnasium import register
except ModuleNotFoundError as error:
    raise ImportError(
        "framerunner.gym needs Gymnasium, which is not installed: pip install 'framerunner[gym]'"
    ) from error

__all__ = ["ENVIRONMENT_ID"]

ENVIRONMENT_ID = "FrameChallenge-v0"

register(id=ENVIRONMENT_ID, entry_point="framerunner.gym.environment:FrameChallengeEnv")
