"""Runs missions for the editor: one that is watched and controlled, or many; each in a process of its own."""
