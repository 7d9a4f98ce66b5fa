"""How late a simulated drone's control ticks are while one of its links is flooded.

    python -m benchmarks.link_flood [--rate 10] [--seconds 4]

For each kind of link and each kind of bytes: the latest control tick, the longest processor time that links
took between two ticks, the share of real time reached, and how many valid packets were received of those sent
amid the flood and of those sent on a second link. The sender is a process of its own. Uses the fixed ports of
`framerunner sim`.
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

from framerunner.wire.dialect import mavlink
from framerunner.wire.link import Traffic
from scenarios.loader import load_scenario
from sitl import server
from sitl.pacing.pacer import Pacer
from sitl.server_settings import ServerSettings, parse_link
from sitl.simulation import Simulation

LINKS = ("udp", "udp, 60 kB", "tcp", "serial")
TCP_PORT = 5790
ONBOARD_PORT = 14580
GROUND_PORT = 18570
PIECE_BYTES = {"udp": 1400, "udp, 60 kB": 60_000, "tcp": 60_000, "serial": 4000}
PACKETS_HZ = 50  # valid packets amid the flood, and on the other link
HEARTBEAT = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3)
SETPOINT = mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 8, 0x5C7, *[0.0] * 11)
COLUMNS = (
    *("link", "bytes", "MB/s sent", "latest tick (ms)", "99 % (ms)", "links, CPU (ms)"),
    *("of real time", "of a core", "received amid it", "on the other link"),
)
FLOODER, AMID, OTHER = 77, 78, 79  # system ids: of the flood, of valid packets amid it, on the other link


def packed(message: object, system_id: int) -> bytes:
    return bytes(message.pack(mavlink.MAVLink(None, system_id, 190)))


def flood_bytes() -> dict[str, bytes]:
    """About a megabyte of each kind of flood."""
    rng = random.Random(1)
    setpoint, beat = packed(SETPOINT, FLOODER), packed(HEARTBEAT, FLOODER)
    size = 1 << 20
    kinds = {
        "nothing": b"",
        "random": rng.randbytes(size),
        "zeros": bytes(size),
        "all 0xFE": b"\xfe" * size,
        "all 0xFD": b"\xfd" * size,
        # each header announces 255 bytes of payload and the next one is within them
        "false headers": b"\xfd\xff\x00\x00\x00\x01\x01\x54\x00\x00",
        "bad checksums": bytes((*setpoint[:-1], setpoint[-1] ^ 0xFF)),
        "truncated": setpoint[:-9],
        "heartbeats": beat,
        "setpoints": setpoint,
    }
    return {name: data * max(1, size // max(1, len(data))) for name, data in kinds.items()}


class TimedPacer(Pacer):
    """Records how late each burst of ticks began and how long links were served before it, seconds.

    The first depends on the load of the machine, the second, processor time, does not.
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


received: Counter[int] = Counter()  # valid packets by system id
count_traffic = Traffic.receive


def count_packet(traffic: Traffic, sender: tuple[int, int], sequence: int, size: int) -> None:
    received[sender[0]] += 1
    count_traffic(traffic, sender, sequence, size)


def send(link: str, line: int, data: bytes, options: argparse.Namespace, done: Connection) -> None:
    """Flood a link, with valid packets of another sender in between and on the ground link."""
    write = opened(link, line)
    ground = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    amid, other = (mavlink.MAVLink(None, system, 190) for system in (AMID, OTHER))
    piece = PIECE_BYTES[link]
    began_s = time.monotonic()
    sent = place = packets = refused = 0
    while (passed_s := time.monotonic() - began_s) < options.seconds:
        if passed_s * PACKETS_HZ >= packets:
            packets += 1
            amid.seq = other.seq = packets % 256
            refused += not write(bytes(HEARTBEAT.pack(amid)))
            ground.sendto(HEARTBEAT.pack(other), ("127.0.0.1", GROUND_PORT))
        if data and sent < passed_s * options.rate * 1e6:
            write(data[place : place + piece])
            sent += piece
            place = (place + piece) % (len(data) - piece)
        else:
            time.sleep(0.001)
    done.send((sent / options.seconds, packets, refused))


def opened(link: str, line: int) -> Callable[[bytes], bool]:
    """A function that writes to a link and returns whether there was room."""
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
    """Fly while one link is flooded; return a row of the table."""
    ours, theirs = pty.openpty()
    urls = (f"tcpin://127.0.0.1:{TCP_PORT}", f"serial://{os.ttyname(theirs)}:921600")
    settings = ServerSettings(links=tuple(parse_link(url) for url in urls))
    ready = asyncio.Event()
    simulation = Simulation(load_scenario(options.scenario))
    sim = server.SimulatorServer(simulation, settings, lambda line: "Ctrl-C" in line and ready.set())
    running = asyncio.create_task(sim.run())
    await ready.wait()
    drain = asyncio.create_task(drained(ours))
    await asyncio.sleep(1.0)
    fork = multiprocessing.get_context("fork")
    result, sender_end = fork.Pipe(duplex=False)
    sender = fork.Process(target=send, args=(link, ours, data, options, sender_end))
    sender.start()
    TimedPacer.late_s.clear()
    TimedPacer.worked_s.clear()
    received.clear()
    began = (time.monotonic(), time.process_time(), simulation.time_us)
    rate, packets, refused = await asyncio.to_thread(result.recv)
    wall_s, cpu_s = time.monotonic() - began[0], time.process_time() - began[1]
    flown_s = (simulation.time_us - began[2]) / 1e6
    late_s = sorted(TimedPacer.late_s)
    sender.join()
    await asyncio.sleep(0.2)
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
        f"{received[AMID]}/{packets - refused}",
        f"{received[OTHER]}/{packets}",
    ]


async def drained(line: int) -> None:
    """Discard what the drone sends on the serial line."""
    os.set_blocking(line, False)
    while True:
        with contextlib.suppress(OSError):
            os.read(line, 1 << 16)
        await asyncio.sleep(0.01)


def read_options() -> argparse.Namespace:
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
    """Flood each link with each kind of bytes and show the results."""
    options = read_options()
    server.Pacer = TimedPacer  # type: ignore[misc, attr-defined]
    Traffic.receive = count_packet  # type: ignore[method-assign]
    table = Table(title=f"one link flooded with up to {options.rate:g} MB/s for {options.seconds:g} s")
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
