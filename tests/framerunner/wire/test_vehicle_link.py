"""The link of receiving programs: each kind of address, and errors of one line."""

import os
import pty
import socket
import termios
import threading
import tty
from unittest.mock import Mock

import pytest
from pymavlink.dialects.v20 import common as mavlink

from framerunner.wire.dialect import companion_heartbeat, is_vehicle, request_message
from framerunner.wire.transports import sockets
from framerunner.wire.transports.sockets import open_serial
from framerunner.wire.transports.urls import LinkError
from framerunner.wire.transports.vehicle_link import VehicleLink
from tests.free_ports import free_port


def open_link(url):
    return VehicleLink(url, system_id=246, component_id=191)


def packet(sequence=0, kind=2, component=1, system=3):
    codec = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
    codec.seq = sequence
    return mavlink.MAVLink_heartbeat_message(kind, 12, 0, 0, 3, 3).pack(codec)


def next_message(link):
    for _ in range(50):
        messages = link.receive(0.1)
        if messages:
            return messages[0]
    raise AssertionError("nothing came")


def parsed(data):
    return mavlink.MAVLink(None).parse_buffer(data)[0]


def test_of_several_vehicles_on_one_port_each_gets_what_is_for_it():
    port = free_port()
    link = open_link(f"udpin://127.0.0.1:{port}")
    vehicles = {system: socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for system in (3, 4)}
    try:
        for system, vehicle in vehicles.items():
            vehicle.settimeout(5)
            vehicle.sendto(packet(system=system), ("127.0.0.1", port))
            assert next_message(link).get_srcSystem() == system
        for system, vehicle in vehicles.items():
            link.send(request_message(system, 148))
            link.send(mavlink.MAVLink_manual_control_message(system, 0, 0, 500, 0, 0))
            assert [parsed(vehicle.recv(300)).get_type() for _ in range(2)] == [
                "COMMAND_LONG",
                "MANUAL_CONTROL",
            ]
        link.send(companion_heartbeat())
        assert {parsed(vehicle.recv(300)).get_type() for vehicle in vehicles.values()} == {"HEARTBEAT"}
    finally:
        for vehicle in vehicles.values():
            vehicle.close()
        link.close()


def test_a_listening_udp_link_answers_the_latest_sender():
    port = free_port()
    link = open_link(f"udpin://127.0.0.1:{port}")
    vehicle = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        link.send(companion_heartbeat())  # to nobody
        vehicle.sendto(packet(), ("127.0.0.1", port))
        heard = next_message(link)
        assert (heard.get_srcSystem(), is_vehicle(heard)) == (3, True)
        link.send(request_message(3, 148))
        vehicle.settimeout(5)
        asked = parsed(vehicle.recv(300))
        assert (asked.command, asked.param1, asked.param7) == (512, 148, 0)
        assert (asked.get_srcSystem(), asked.get_srcComponent(), asked.target_system) == (246, 191, 3)
    finally:
        vehicle.close()
        link.close()


def test_sending_first_over_udp():
    vehicle = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    vehicle.bind(("127.0.0.1", 0))
    link = open_link(f"udpout://127.0.0.1:{vehicle.getsockname()[1]}")
    try:
        link.send(companion_heartbeat())
        vehicle.settimeout(5)
        data, address = vehicle.recvfrom(300)
        assert not is_vehicle(parsed(data))
        vehicle.sendto(packet(), address)
        assert next_message(link).get_srcSystem() == 3
    finally:
        vehicle.close()
        link.close()


def test_calling_over_tcp_and_the_other_side_hanging_up():
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = open_link(f"tcpout://127.0.0.1:{server.getsockname()[1]}")
        vehicle, _ = server.accept()
        vehicle.sendall(packet()[:9])
        assert link.receive(0.5) == []  # half a packet is none
        vehicle.sendall(packet()[9:])
        assert next_message(link).get_srcSystem() == 3
        vehicle.close()
        with pytest.raises(LinkError, match="closed the connection"):
            link.receive(1.0)
        link.close()


def test_being_called_over_tcp_again_and_again():
    port = free_port()
    link = open_link(f"tcpin://127.0.0.1:{port}")
    try:
        for _ in range(2):
            with socket.create_connection(("127.0.0.1", port)) as vehicle:
                vehicle.sendall(packet())
                assert next_message(link).get_srcSystem() == 3
            assert link.receive(0.1) == []
    finally:
        link.close()


def test_a_serial_line():
    vehicle, device = pty.openpty()
    link = open_link(f"serial://{os.ttyname(device)}:57600")
    try:
        writer = threading.Thread(target=os.write, args=(vehicle, packet()))
        writer.start()
        assert next_message(link).get_srcSystem() == 3
        writer.join()
        link.send(companion_heartbeat())
        assert parsed(os.read(vehicle, 300)).get_type() == "HEARTBEAT"
    finally:
        link.close()
        os.close(vehicle)
        os.close(device)


def test_a_serial_line_passes_all_bytes_at_its_speed_and_a_silent_one_is_not_lost():
    vehicle, device = pty.openpty()
    tty.setraw(vehicle)
    everything = bytes(range(256))
    line = open_serial(os.ttyname(device), 921600)
    try:
        assert termios.tcgetattr(device)[4:6] == [termios.B921600, termios.B921600]
        assert line.read() is None
        os.write(vehicle, everything)
        assert line.read() == everything
        line.write(everything)
        assert os.read(vehicle, 300) == everything
        os.close(vehicle)
        with pytest.raises(ConnectionResetError, match="the serial line is gone"):
            line.read()
    finally:
        line.close()
        os.close(device)


@pytest.mark.parametrize("error", [termios.error(5, "Input/output error"), ValueError("no")])
def test_a_serial_line_that_is_lost_while_it_is_opened_is_one_clear_line(monkeypatch, error):
    monkeypatch.setattr(sockets, "Serial", Mock(side_effect=error, BAUDRATES=(57600,)))
    with pytest.raises(LinkError, match="/dev/ttyUSB0: this is not a serial line"):
        open_serial("/dev/ttyUSB0", 57600)


def test_noise_between_packets_is_passed_over():
    port = free_port()
    link = open_link(f"udpin://127.0.0.1:{port}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.sendto(b"\xfd\x00rubbish" * 20, ("127.0.0.1", port))
        assert link.receive(1.0) == []
        bad = bytearray(packet())
        bad[-1] ^= 0xFF
        vehicle.sendto(bytes(bad) + packet(1), ("127.0.0.1", port))
        vehicle.sendto(b"\x00" * 300 + packet(2), ("127.0.0.1", port))
        assert next_message(link).get_type() == "HEARTBEAT"
    link.close()


@pytest.mark.parametrize("noise", [b"\xfd\xff\x00", b"\xfe\x09"])
def test_a_false_header_costs_no_packet_that_follows(noise):
    port = free_port()
    link = open_link(f"udpin://127.0.0.1:{port}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.sendto(noise + b"".join(packet(count) for count in range(20)), ("127.0.0.1", port))
        heard = [message for message in link.receive(1.0) if message.get_type() == "HEARTBEAT"]
        assert [message.get_seq() for message in heard] == list(range(20))
    link.close()


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("udp://:14540", "bad drone address"),
        ("serial:///dev/null:57600", "not a serial line"),
        ("serial:///dev/null:12345", "12345 is not a usual baud rate"),
        ("serial:///dev/null:0", "0 is not a usual baud rate"),
        ("serial:///dev/not-there:57600", "cannot be opened .No such file or directory.; is it plugged in"),
        (
            "udpout://no.such.host.invalid:14550",
            "UDP no.such.host.invalid:14550 cannot be sent to",
        ),
    ],
)
def test_an_address_that_cannot_be_had_is_one_clear_line(url, words):
    with pytest.raises(LinkError, match=words) as refused:
        open_link(url)
    assert "\n" not in str(refused.value)


def test_a_closed_tcp_port_and_a_taken_udp_port_are_one_clear_line():
    with pytest.raises(LinkError, match="refused"):
        open_link(f"tcpout://127.0.0.1:{free_port()}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        with pytest.raises(LinkError, match="another flight or ground station"):
            open_link(f"udpin://127.0.0.1:{other.getsockname()[1]}")


def test_companions_cameras_and_ground_stations_are_no_vehicles():
    assert is_vehicle(parsed(packet()))
    assert not is_vehicle(parsed(packet(component=100)))
    assert not is_vehicle(parsed(packet(kind=6)))
