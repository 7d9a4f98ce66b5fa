"""One vehicle, as its messages show it: each module follows some kinds of messages.

Throughout, `drone_id` is a MAVLink system id, `now_s` the time of the asyncio loop, `host` the IP address of
a message's sender ("" on a serial line), and `publish` takes messages for the pages.
"""
