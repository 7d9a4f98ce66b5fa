"""What is streamed of a drone: camera images, referee, RTP."""
