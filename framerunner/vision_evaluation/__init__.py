"""How good the detectors are: images of known scenes, what each detector makes of them, and a report."""
