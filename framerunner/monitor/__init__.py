"""The Game Monitor: drones, missions, tries and replays in a browser."""
