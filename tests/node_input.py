"""Gives bytes to a MAVLink node as its links do."""


def deliver(node, link, data):
    """Have a node act on bytes that came in on a link, all at once."""
    for first in range(0, len(data), 1 << 15):
        node.add_input(link, data[first : first + (1 << 15)])
        while node.process_input(link, 1000):
            pass
