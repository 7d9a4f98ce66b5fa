"""A bad link for tests: it loses, doubles and swaps datagrams, the same ones every time."""

import random

from framerunner.wire.framing import PacketReader
from tests.node_input import deliver


class LossyPipe:
    """One direction of a link. Datagrams go in one by one and come out, or not, in some order.

    Args:
        seed: the same seed does the same to the same datagrams.
        loss: share that is lost.
        duplicate: share that comes twice.
        reorder: share that is held back behind the next one to three datagrams.
    """

    def __init__(self, seed, *, loss=0.05, duplicate=0.05, reorder=0.05):
        self._random = random.Random(seed)
        self._loss, self._duplicate, self._reorder = loss, duplicate, reorder
        self._held = []  # [datagrams to wait for, datagram]
        self.lost = self.doubled = self.reordered = 0

    def push(self, datagram):
        """Send one datagram; those that arrive now."""
        chance = self._random.random
        arrived = []
        if chance() < self._loss:
            self.lost += 1
        elif chance() < self._reorder:
            self.reordered += 1
            self._held.append([self._random.randint(2, 4), datagram])
        else:
            arrived.append(datagram)
            if chance() < self._duplicate:
                self.doubled += 1
                arrived.append(datagram)
        for held in self._held:
            held[0] -= 1
        arrived += [held[1] for held in self._held if held[0] <= 0]
        self._held = [held for held in self._held if held[0] > 0]
        return arrived

    def rest(self):
        """What is still held back, when nothing more will come."""
        rest, self._held = [held[1] for held in self._held], []
        return rest


class LossyPeer:
    """A client whose link to a node is bad in both directions; each packet is a datagram of its own.

    Args:
        peer: the `Peer` of conftest.py whose node is spoken to.
        link: by which.
        seed: of the misfortunes.
        options: of `LossyPipe`.
    """

    def __init__(self, peer, link="onboard", seed=1, **options):
        self.peer = peer
        self.link = link
        self.up = LossyPipe(seed, **options)
        self.down = LossyPipe(seed + 1_000_003, **options)
        self._reader = PacketReader()

    def send(self, message, **options):
        """Send a message to the node, with luck."""
        for datagram in self.up.push(message.pack(self.peer.packer, **options)):
            deliver(self.peer.node, self.link, datagram)

    def take(self):
        """Messages that arrived from the node now, streams and all."""
        messages = []
        for link, data in self.peer.node.take_output():
            if link != self.link:
                continue
            for packet in _packets(data):
                for datagram in self.down.push(packet):
                    messages += self._reader.feed(datagram)
        return messages

    def advance(self, seconds, *, step_us=4000):
        """Let vehicle time pass; messages that arrived."""
        peer, messages = self.peer, []
        end_us = peer.time_us + round(seconds * 1e6)
        while peer.time_us < end_us:
            peer.time_us = min(peer.time_us + step_us, end_us)
            peer.node.update(peer.time_us)
            messages += self.take()
        return messages


def _packets(datagram):
    """The packets of one of the node's datagrams, so that each one can be lost alone."""
    packets, place = [], 0
    while place < len(datagram):
        length = 12 + datagram[place + 1] + (13 if datagram[place + 2] & 1 else 0)
        packets.append(bytes(datagram[place : place + length]))
        place += length
    return packets
