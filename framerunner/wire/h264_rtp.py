"""How a stream of H.264 in RTP is described to its receiver."""

from __future__ import annotations

PAYLOAD_TYPE = 96
"""The first of the dynamic types, which programs that send only one stream use."""
RTP_CLOCK_HZ = 90_000


def describe_h264_rtp(host: str, port: int) -> str:
    """The stream in SDP (RFC 8866, RFC 6184), as a receiver on a host and UDP port needs it."""
    lines = (
        "v=0",
        f"o=- 0 0 IN IP4 {host}",
        "s=framerunner camera",
        f"c=IN IP4 {host}",
        "t=0 0",
        f"m=video {port} RTP/AVP {PAYLOAD_TYPE}",
        f"a=rtpmap:{PAYLOAD_TYPE} H264/{RTP_CLOCK_HZ}",
        f"a=fmtp:{PAYLOAD_TYPE} packetization-mode=1",
    )
    return "\r\n".join(lines) + "\r\n"
