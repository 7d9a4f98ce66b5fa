"""Network cameras: MJPEG over HTTP, the time of each image, streams that are opened again."""
