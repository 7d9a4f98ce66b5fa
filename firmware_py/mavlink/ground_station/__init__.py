"""What only makes ground stations complete; no flight needs it.

Files (FTP), logs, events, metadata, remote id, a shell, calibration.
"""
