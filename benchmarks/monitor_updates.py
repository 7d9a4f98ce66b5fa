"""What ten viewers of a moving drone cost the server: NiceGUI's scene objects, or one text over a WebSocket.

    python -m benchmarks.monitor_updates

Each method has a server in a process of its own and ten viewers that read 20 poses a second. With `ui.scene`,
each viewer's drone (one group, its rotors not turning) is moved and turned from Python; by WebSocket one JSON
text with all of the message "pose" is made once and sent to all. Printed are the processor time of the server
as a share of one core, and the messages sent to each viewer.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import socket
import sys
import time

from starlette.websockets import WebSocket

VIEWERS = 10
RATE_HZ = 20
SECONDS = 10.0
SETTLE_S = 1.0


async def serve(method: str, port: int) -> None:
    """Serve until standard input ends; a line on it requests the processor time used so far."""
    import uvicorn
    from fastapi import FastAPI
    from nicegui import ui

    web = FastAPI()
    tick = METHODS[method][0](web)
    ui.run_with(web, show_welcome_message=False)
    options = {
        "log_level": "critical",
        "access_log": False,
        "ws_per_message_deflate": False,
        "lifespan": "on",
    }
    server = uvicorn.Server(uvicorn.Config(web, port=port, timeout_graceful_shutdown=1, **options))
    serving = asyncio.create_task(server.serve())
    moving = asyncio.create_task(at_rate(tick))
    await asyncio.to_thread(print_processor_time)
    moving.cancel()
    server.should_exit = True
    await serving


def print_processor_time() -> None:
    for _ in sys.stdin:
        print(json.dumps([time.process_time(), time.monotonic()]), flush=True)


async def at_rate(tick):
    begin_s = time.monotonic()
    count = 0
    while True:
        tick(count / RATE_HZ)
        count += 1
        await asyncio.sleep(max(0.0, begin_s + count / RATE_HZ - time.monotonic()))


def add_scene(web):
    """Move a group for each viewer."""
    from nicegui import ui

    drones = []

    @ui.page("/")
    def page():
        with ui.scene() as scene, scene.group() as drone:
            scene.box(0.3, 0.3, 0.1)
            for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                scene.cylinder(0.1, 0.1, 0.02).move(0.2 * x, 0.2 * y, 0.05)
        scene._initialized_event.set()  # else it waits for the browser's message
        drones.append(drone)

    def tick(t):
        for drone in drones:
            drone.move(0.1 * t % 10, 1.0 + 0.001 * t, 1.5)
            drone.rotate(0.01 * t, 0.02, 0.1 * t)

    return tick


def add_websocket(web):
    """Make one text and send it to all."""
    from monitor.live_channel import LiveChannel, Viewer

    class Drones:
        def welcome(self):
            return []

    channel = LiveChannel(Drones())

    @web.websocket("/ws/live")
    async def live(websocket: WebSocket):
        await websocket.accept()
        viewer = Viewer()
        channel.enter(viewer)
        with contextlib.suppress(Exception):
            while (text := await viewer.next()) is not None:
                await websocket.send_text(text)
        channel.leave(viewer)

    return lambda t: channel.send(pose(t))


def pose(t):
    """A message as the monitor's channel has them, with as many digits as telemetry has."""
    x = 0.123456789 * t
    drone = {
        "id": 1,
        "t": t,
        "p": [x, 1.0 + x / 7, 1.5 + x / 9],
        "q": [0.987654321, x / 100, 0.012345678, 0.123456789],
        "v": [0.512345678, x / 11, 0.01234567],
        "r": 0.0123456789,
        "c": [0.5, 0.0, x / 13, 0.0],
        "on": True,
        "s": 3,
        "fresh": True,
    }
    return {"kind": "pose", "drones": [drone]}


async def watch_scene(port, counts, number):
    """Act as a browser with a page does, without drawing."""
    import aiohttp
    import socketio

    async with aiohttp.ClientSession() as session, session.get(f"http://127.0.0.1:{port}/") as response:
        client_id = re.search(
            r'"client_id":\s*"([0-9a-f-]+)"|client_id\W+([0-9a-f-]{36})', await response.text()
        )
    client_id = client_id.group(1) or client_id.group(2)
    viewer = socketio.AsyncClient()

    @viewer.on("run_javascript")
    async def moved(_):
        counts[number] += 1

    query = f"client_id={client_id}&tab_id={number}&document_id={number}"
    query += "&next_message_id=0&implicit_handshake=true"
    await viewer.connect(
        f"http://127.0.0.1:{port}/?{query}", socketio_path="/_nicegui_ws/socket.io", transports=["websocket"]
    )
    with contextlib.suppress(asyncio.CancelledError):
        while True:  # NiceGUI's pages acknowledge every three seconds
            await asyncio.sleep(3.0)
            await viewer.emit("ack", {"client_id": client_id, "next_message_id": counts[number]})
    await viewer.disconnect()


async def watch_websocket(port, counts, number):
    import aiohttp

    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(f"http://127.0.0.1:{port}/ws/live") as ws,
    ):
        async for _ in ws:
            counts[number] += 1


METHODS = {"scene": (add_scene, watch_scene), "websocket": (add_websocket, watch_websocket)}


async def measure(method: str) -> tuple[float, float]:
    """The server's share of a core, and the messages sent to each viewer a second."""
    port = free_port()
    arguments = (sys.executable, "-m", "benchmarks.monitor_updates", method, str(port))
    pipe = asyncio.subprocess.PIPE
    server = await asyncio.create_subprocess_exec(*arguments, stdin=pipe, stdout=pipe)
    counts = [0] * VIEWERS
    watching = []
    try:
        await reachable(port)
        watch = METHODS[method][1]
        watching = [asyncio.create_task(watch(port, counts, number)) for number in range(VIEWERS)]
        await asyncio.sleep(SETTLE_S)
        before, seen = await processor_time(server), sum(counts)
        await asyncio.sleep(SECONDS)
        after, seen = await processor_time(server), sum(counts) - seen
    finally:
        for task in watching:
            task.cancel()
        await asyncio.gather(*watching, return_exceptions=True)
        server.stdin.close()
        await server.wait()
    if not all(counts):
        raise RuntimeError("a viewer was sent nothing")
    wall_s = after[1] - before[1]
    return (after[0] - before[0]) / wall_s, seen / VIEWERS / wall_s


async def processor_time(server):
    server.stdin.write(b"\n")
    return json.loads(await server.stdout.readline())


async def reachable(port: int) -> None:
    for _ in range(200):
        try:
            _, writer = await asyncio.open_connection("127.0.0.1", port)
        except OSError:
            await asyncio.sleep(0.1)
        else:
            writer.close()
            return
    raise RuntimeError("the server does not start")


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


if __name__ == "__main__":
    if len(sys.argv) > 1:
        asyncio.run(serve(sys.argv[1], int(sys.argv[2])))
    else:
        for method in METHODS:
            share, rate = asyncio.run(measure(method))
            print(
                f"{method:10} {100 * share:5.1f} % of a core, {rate:5.1f} messages a second and viewer",
                flush=True,
            )
