"""Rules of a flight with a real drone: checks before arming, caps, the fence, failsafes, the operator."""
