"""How late a simulated drone's control ticks are while one of its links is flooded.

    python -m benchmarks.link_flood [--rate 10] [--seconds 4]

For each kind of link and each kind of bytes: the latest control tick, the longest that the links kept the
processor between two ticks, the share of real time reached, and how many sound packets were heard of those
sent amid the flood and of those sent on a second link. The sender is a process of its own. Uses the fixed
ports of `framerunner sim`.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import multiprocessing
import os
import pty
import random
import socket
import sys
import time
from collections import Counter
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import ClassVar

from rich.console import Console
from rich.table import Table

from scenarios.loader import load_scenario
from sitl import server
from sitl.server_settings import ServerSettings, parse_link
from sitl.simulation import Simulation
from wire.dialect import mavlink
from wire.link import Traffic

LINKS = ("udp", "udp, 60 kB", "tcp", "serial")
TCP_PORT = 5790
ONBOARD_PORT = 14580
GROUND_PORT = 18570
PIECE_BYTES = {"udp": 1400, "udp, 60 kB": 60_000, "tcp": 60_000, "serial": 4000}
PACKETS_HZ = 50  # sound packets amid the flood, and on the quiet link
HEARTBEAT = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3)
SETPOINT = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 8, 0x5C7, *[0.0] * 11)
COLUMNS = (
    "link",
    "bytes",
    "MB/s sent",
    "latest tick (ms)",
    "99 % (ms)",
    "links, CPU (ms)",
    "of real time",
    "of a core",
    "heard amid it",
    "on the other link",
)
FLOODER, STRANGER, FRIEND = 77, 78, 79  # system ids


def packed(message: object, system_id: int) -> bytes:
    return bytes(message.pack(mavlink.MAVLink(None, system_id, 190)))


def flood_bytes() -> dict[str, bytes]:
    """A megabyte or so of each kind of flood."""
    rng = random.Random(1)
    setpoint, beat = packed(SETPOINT, FLOODER), packed(HEARTBEAT, FLOODER)
    bad = bytes((*setpoint[:-1], setpoint[-1] ^ 0xFF))
    size = 1 << 20
    kinds = {
        "nothing": b"",
        "random": rng.randbytes(size),
        "zeros": bytes(size),
        "all 0xFE": b"\xfe" * size,
        "all 0xFD": b"\xfd" * size,
        # each header asks for 255 bytes of payload and the next one stands within it
        "false headers": b"\xfd\xff\x00\x00\x00\x01\x01\x54\x00\x00",
        "bad checksums": bad,
        "truncated": setpoint[:-9],
        "heartbeats": beat,
        "setpoints": setpoint,
    }
    return {name: data * max(1, size // max(1, len(data))) for name, data in kinds.items()}


class TimedPacer(server.Pacer):
    """Remembers, in seconds, how late each burst of ticks began and how long links were worked on before it.

    The first depends on what else the machine does, the second, processor time, does not.
    """

    late_s: ClassVar[list[float]] = []
    worked_s: ClassVar[list[float]] = []
    due_us = 0
    used_s = 0.0

    def wait_s(self, now_s: float, time_us: int) -> float:
        self.due_us = time_us
        self.used_s = time.thread_time()
        return super().wait_s(now_s, time_us)

    def target_us(self, now_s: float) -> int:
        target_us = super().target_us(now_s)
        if sys._getframe(1).f_code.co_name == "_run_paced":
            self.late_s.append((target_us - self.due_us) * 1e-6)
            self.worked_s.append(time.thread_time() - self.used_s)
        return target_us


class Heard:
    """Counts the sound packets of each sender, by system id."""

    packets: ClassVar[Counter[int]] = Counter()
    count = Traffic.hear

    @staticmethod
    def hear(traffic: Traffic, sender: tuple[int, int], sequence: int, size: int) -> None:
        Heard.packets[sender[0]] += 1
        Heard.count(traffic, sender, sequence, size)


def send(link: str, line: int, data: bytes, options: argparse.Namespace, done: Connection) -> None:
    """Flood a link and put sound packets of another sender in between; a friend speaks on the ground link."""
    write = opened(link, line)
    ground = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    stranger, friend = (mavlink.MAVLink(None, system, 190) for system in (STRANGER, FRIEND))
    piece = PIECE_BYTES[link]
    began_s = time.monotonic()
    sent = place = packets = refused = 0
    while (passed_s := time.monotonic() - began_s) < options.seconds:
        if passed_s * PACKETS_HZ >= packets:
            packets += 1
            stranger.seq = friend.seq = packets % 256
            refused += not write(bytes(HEARTBEAT.pack(stranger)))
            ground.sendto(HEARTBEAT.pack(friend), ("127.0.0.1", GROUND_PORT))
        if data and sent < passed_s * options.rate * 1e6:
            write(data[place : place + piece])
            sent += piece
            place = (place + piece) % (len(data) - piece)
        else:
            time.sleep(0.001)
    done.send((sent / options.seconds, packets, refused))


def opened(link: str, line: int) -> Callable[[bytes], bool]:
    """What writes to a link; it says whether there was room."""
    if link.startswith("udp"):
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        return lambda data: udp.sendto(data, ("127.0.0.1", ONBOARD_PORT)) > 0
    if link == "tcp":
        tcp = socket.create_connection(("127.0.0.1", TCP_PORT))
        tcp.settimeout(0.05)

        def send_all(data: bytes) -> bool:
            try:
                tcp.sendall(data)
            except TimeoutError:
                return False
            return True

        return send_all

    def write(data: bytes) -> bool:
        try:
            return os.write(line, data) == len(data)
        except BlockingIOError:
            return False

    return write


async def flooded(link: str, data: bytes, options: argparse.Namespace) -> list[str]:
    """Fly while one link is flooded; a row of the table."""
    ours, theirs = pty.openpty()
    urls = (f"tcpin://127.0.0.1:{TCP_PORT}", f"serial://{os.ttyname(theirs)}:921600")
    settings = ServerSettings(links=tuple(parse_link(url) for url in urls))
    greeted = asyncio.Event()
    notices: list[str] = []

    def notice(line: str) -> None:
        notices.append(line)
        if "Ctrl-C" in line:
            greeted.set()

    simulation = Simulation(load_scenario(options.scenario))
    sim = server.SimulatorServer(simulation, settings, notice)
    running = asyncio.create_task(sim.run())
    await greeted.wait()
    drain = asyncio.create_task(drained(ours))
    await asyncio.sleep(1.0)
    inlet, outlet = multiprocessing.get_context("fork").Pipe(duplex=False)
    arguments = (link, ours, data, options, outlet)
    sender = multiprocessing.get_context("fork").Process(target=send, args=arguments)
    sender.start()
    TimedPacer.late_s.clear()
    TimedPacer.worked_s.clear()
    Heard.packets.clear()
    began = (time.monotonic(), time.process_time(), simulation.time_us)
    rate, packets, refused = await asyncio.to_thread(inlet.recv)
    wall_s, cpu_s = time.monotonic() - began[0], time.process_time() - began[1]
    flown_s = (simulation.time_us - began[2]) / 1e6
    late_s = sorted(TimedPacer.late_s)
    sender.join()
    await asyncio.sleep(0.2)
    heard = Heard.packets
    running.cancel()
    drain.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await running
    for end in (ours, theirs):
        os.close(end)
    return [
        f"{rate / 1e6:.1f}",
        f"{late_s[-1] * 1e3:.1f}",
        f"{late_s[int(len(late_s) * 0.99)] * 1e3:.1f}",
        f"{max(TimedPacer.worked_s) * 1e3:.1f}",
        f"{flown_s / wall_s:.2f}",
        f"{cpu_s / wall_s:.2f}",
        f"{heard[STRANGER]}/{packets - refused}",
        f"{heard[FRIEND]}/{packets}",
    ]


async def drained(line: int) -> None:
    """Read what the drone says on the serial line."""
    os.set_blocking(line, False)
    while True:
        with contextlib.suppress(OSError):
            os.read(line, 1 << 16)
        await asyncio.sleep(0.01)


def read_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.link_flood", description=__doc__.partition("\n")[0]
    )
    parser.add_argument("--rate", type=float, default=10.0, metavar="MB/s", help="of the flood (default 10)")
    parser.add_argument("--seconds", type=float, default=4.0, metavar="S", help="of each flood (default 4)")
    parser.add_argument("--scenario", default="test-case-1", metavar="NAME", help="name or file")
    parser.add_argument("--links", nargs="+", choices=LINKS, default=LINKS, help="which to flood (all)")
    parser.add_argument("--kinds", nargs="+", choices=flood_bytes(), help="with what (all)")
    return parser.parse_args()


def main() -> int:
    """Flood each link with everything and show what came of it."""
    options = read_options()
    server.Pacer = TimedPacer  # type: ignore[misc]
    Traffic.hear = Heard.hear  # type: ignore[method-assign]
    table = Table(title=f"a link flooded with up to {options.rate:g} MB/s for {options.seconds:g} s")
    for column in COLUMNS:
        table.add_column(column, justify="left" if column in ("link", "bytes") else "right")
    for link in options.links:
        for kind, data in flood_bytes().items():
            if options.kinds is None or kind in options.kinds:
                table.add_row(link, kind, *asyncio.run(flooded(link, data, options)))
    Console(width=None if sys.stdout.isatty() else 130).print(table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
