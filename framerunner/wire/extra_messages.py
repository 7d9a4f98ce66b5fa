"""Messages and enums that pymavlink's dialects lack, generated from XML by `make messages`."""

import struct
from typing import Dict, Sequence, Type

from pymavlink.dialects.v20.development import (
    Enum,
    EnumEntry,
    MAVLink_message,
    enums,
    mavlink_msg_deprecated_name_property,
)

# ESC_CONNECTION_TYPE
enums["ESC_CONNECTION_TYPE"] = Enum()
enums["ESC_CONNECTION_TYPE"].bitmask = False
ESC_CONNECTION_TYPE_PPM = 0
enums["ESC_CONNECTION_TYPE"][0] = EnumEntry("ESC_CONNECTION_TYPE_PPM", """Traditional PPM ESC.""")
ESC_CONNECTION_TYPE_SERIAL = 1
enums["ESC_CONNECTION_TYPE"][1] = EnumEntry("ESC_CONNECTION_TYPE_SERIAL", """Serial Bus connected ESC.""")
ESC_CONNECTION_TYPE_ONESHOT = 2
enums["ESC_CONNECTION_TYPE"][2] = EnumEntry("ESC_CONNECTION_TYPE_ONESHOT", """One Shot PPM ESC.""")
ESC_CONNECTION_TYPE_I2C = 3
enums["ESC_CONNECTION_TYPE"][3] = EnumEntry("ESC_CONNECTION_TYPE_I2C", """I2C ESC.""")
ESC_CONNECTION_TYPE_CAN = 4
enums["ESC_CONNECTION_TYPE"][4] = EnumEntry("ESC_CONNECTION_TYPE_CAN", """CAN-Bus ESC.""")
ESC_CONNECTION_TYPE_DSHOT = 5
enums["ESC_CONNECTION_TYPE"][5] = EnumEntry("ESC_CONNECTION_TYPE_DSHOT", """DShot ESC.""")
ESC_CONNECTION_TYPE_ENUM_END = 6
enums["ESC_CONNECTION_TYPE"][6] = EnumEntry("ESC_CONNECTION_TYPE_ENUM_END", """""")

# ESC_FAILURE_FLAGS
enums["ESC_FAILURE_FLAGS"] = Enum()
enums["ESC_FAILURE_FLAGS"].bitmask = True
ESC_FAILURE_OVER_CURRENT = 1
enums["ESC_FAILURE_FLAGS"][1] = EnumEntry("ESC_FAILURE_OVER_CURRENT", """Over current failure.""")
ESC_FAILURE_OVER_VOLTAGE = 2
enums["ESC_FAILURE_FLAGS"][2] = EnumEntry("ESC_FAILURE_OVER_VOLTAGE", """Over voltage failure.""")
ESC_FAILURE_OVER_TEMPERATURE = 4
enums["ESC_FAILURE_FLAGS"][4] = EnumEntry("ESC_FAILURE_OVER_TEMPERATURE", """Over temperature failure.""")
ESC_FAILURE_OVER_RPM = 8
enums["ESC_FAILURE_FLAGS"][8] = EnumEntry("ESC_FAILURE_OVER_RPM", """Over RPM failure.""")
ESC_FAILURE_INCONSISTENT_CMD = 16
enums["ESC_FAILURE_FLAGS"][16] = EnumEntry("ESC_FAILURE_INCONSISTENT_CMD", """Inconsistent command failure i.e. out of bounds.""")
ESC_FAILURE_MOTOR_STUCK = 32
enums["ESC_FAILURE_FLAGS"][32] = EnumEntry("ESC_FAILURE_MOTOR_STUCK", """Motor stuck failure.""")
ESC_FAILURE_GENERIC = 64
enums["ESC_FAILURE_FLAGS"][64] = EnumEntry("ESC_FAILURE_GENERIC", """Generic ESC failure.""")
ESC_FAILURE_FLAGS_ENUM_END = 65
enums["ESC_FAILURE_FLAGS"][65] = EnumEntry("ESC_FAILURE_FLAGS_ENUM_END", """""")

# MAV_EVENT_ERROR_REASON
enums["MAV_EVENT_ERROR_REASON"] = Enum()
enums["MAV_EVENT_ERROR_REASON"].bitmask = False
MAV_EVENT_ERROR_REASON_UNAVAILABLE = 0
enums["MAV_EVENT_ERROR_REASON"][0] = EnumEntry("MAV_EVENT_ERROR_REASON_UNAVAILABLE", """The requested event is not available (anymore).""")
MAV_EVENT_ERROR_REASON_ENUM_END = 1
enums["MAV_EVENT_ERROR_REASON"][1] = EnumEntry("MAV_EVENT_ERROR_REASON_ENUM_END", """""")

# MAV_EVENT_CURRENT_SEQUENCE_FLAGS
enums["MAV_EVENT_CURRENT_SEQUENCE_FLAGS"] = Enum()
enums["MAV_EVENT_CURRENT_SEQUENCE_FLAGS"].bitmask = True
MAV_EVENT_CURRENT_SEQUENCE_FLAGS_RESET = 1
enums["MAV_EVENT_CURRENT_SEQUENCE_FLAGS"][1] = EnumEntry("MAV_EVENT_CURRENT_SEQUENCE_FLAGS_RESET", """A sequence reset has happened (e.g. vehicle reboot).""")
MAV_EVENT_CURRENT_SEQUENCE_FLAGS_ENUM_END = 2
enums["MAV_EVENT_CURRENT_SEQUENCE_FLAGS"][2] = EnumEntry("MAV_EVENT_CURRENT_SEQUENCE_FLAGS_ENUM_END", """""")

# message IDs
MAVLINK_MSG_ID_BAD_DATA = -1
MAVLINK_MSG_ID_UNKNOWN = -2
MAVLINK_MSG_ID_LINK_NODE_STATUS = 8
MAVLINK_MSG_ID_ESC_INFO = 290
MAVLINK_MSG_ID_ESC_STATUS = 291
MAVLINK_MSG_ID_PROTOCOL_VERSION = 300
MAVLINK_MSG_ID_TIME_ESTIMATE_TO_TARGET = 380
MAVLINK_MSG_ID_COMPONENT_INFORMATION = 395
MAVLINK_MSG_ID_COMPONENT_METADATA = 397
MAVLINK_MSG_ID_EVENT = 410
MAVLINK_MSG_ID_CURRENT_EVENT_SEQUENCE = 411
MAVLINK_MSG_ID_REQUEST_EVENT = 412
MAVLINK_MSG_ID_RESPONSE_EVENT_ERROR = 413


class MAVLink_link_node_status_message(MAVLink_message):
    """
    Status generated in each node in the communication chain and
    injected into MAVLink stream.
    """

    id = MAVLINK_MSG_ID_LINK_NODE_STATUS
    msgname = "LINK_NODE_STATUS"
    fieldnames = ["timestamp", "tx_buf", "rx_buf", "tx_rate", "rx_rate", "rx_parse_err", "tx_overflows", "rx_overflows", "messages_sent", "messages_received", "messages_lost"]
    ordered_fieldnames = ["timestamp", "tx_rate", "rx_rate", "messages_sent", "messages_received", "messages_lost", "rx_parse_err", "tx_overflows", "rx_overflows", "tx_buf", "rx_buf"]
    fieldtypes = ["uint64_t", "uint8_t", "uint8_t", "uint32_t", "uint32_t", "uint16_t", "uint16_t", "uint16_t", "uint32_t", "uint32_t", "uint32_t"]
    fielddisplays_by_name: Dict[str, str] = {}
    fieldenums_by_name: Dict[str, str] = {}
    fieldunits_by_name: Dict[str, str] = {"timestamp": "ms", "tx_buf": "%", "rx_buf": "%", "tx_rate": "bytes/s", "rx_rate": "bytes/s", "rx_parse_err": "bytes", "tx_overflows": "bytes", "rx_overflows": "bytes"}
    native_format = bytearray(b"<QIIIIIHHHBB")
    orders = [0, 9, 10, 1, 2, 6, 7, 8, 3, 4, 5]
    lengths = [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1]
    array_lengths = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]
    crc_extra = 117
    unpacker = struct.Struct("<QIIIIIHHHBB")
    instance_field = None
    instance_offset = -1

    def __init__(self, timestamp: int, tx_buf: int, rx_buf: int, tx_rate: int, rx_rate: int, rx_parse_err: int, tx_overflows: int, rx_overflows: int, messages_sent: int, messages_received: int, messages_lost: int):
        MAVLink_message.__init__(self, MAVLink_link_node_status_message.id, MAVLink_link_node_status_message.msgname)
        self._fieldnames = MAVLink_link_node_status_message.fieldnames
        self._instance_field = MAVLink_link_node_status_message.instance_field
        self._instance_offset = MAVLink_link_node_status_message.instance_offset
        self.timestamp = timestamp
        self.tx_buf = tx_buf
        self.rx_buf = rx_buf
        self.tx_rate = tx_rate
        self.rx_rate = rx_rate
        self.rx_parse_err = rx_parse_err
        self.tx_overflows = tx_overflows
        self.rx_overflows = rx_overflows
        self.messages_sent = messages_sent
        self.messages_received = messages_received
        self.messages_lost = messages_lost

    def pack(self, mav: "MAVLink", force_mavlink1: bool = False) -> bytes:
        return self._pack(mav, self.crc_extra, self.unpacker.pack(self.timestamp, self.tx_rate, self.rx_rate, self.messages_sent, self.messages_received, self.messages_lost, self.rx_parse_err, self.tx_overflows, self.rx_overflows, self.tx_buf, self.rx_buf), force_mavlink1=force_mavlink1)


# Define name on the class for backwards compatibility (it is now msgname).
# Done with setattr to hide the class variable from mypy.
setattr(MAVLink_link_node_status_message, "name", mavlink_msg_deprecated_name_property())


class MAVLink_esc_info_message(MAVLink_message):
    """
    ESC information for lower rate streaming. Recommended streaming
    rate 1Hz. See ESC_STATUS for higher-rate ESC data.
    """

    id = MAVLINK_MSG_ID_ESC_INFO
    msgname = "ESC_INFO"
    fieldnames = ["index", "time_usec", "counter", "count", "connection_type", "info", "failure_flags", "error_count", "temperature"]
    ordered_fieldnames = ["time_usec", "error_count", "counter", "failure_flags", "temperature", "index", "count", "connection_type", "info"]
    fieldtypes = ["uint8_t", "uint64_t", "uint16_t", "uint8_t", "uint8_t", "uint8_t", "uint16_t", "uint32_t", "int16_t"]
    fielddisplays_by_name: Dict[str, str] = {"failure_flags": "bitmask"}
    fieldenums_by_name: Dict[str, str] = {"connection_type": "ESC_CONNECTION_TYPE", "failure_flags": "ESC_FAILURE_FLAGS"}
    fieldunits_by_name: Dict[str, str] = {"time_usec": "us", "temperature": "cdegC"}
    native_format = bytearray(b"<QIHHhBBBB")
    orders = [5, 0, 2, 6, 7, 8, 3, 1, 4]
    lengths = [1, 4, 1, 4, 4, 1, 1, 1, 1]
    array_lengths = [0, 4, 0, 4, 4, 0, 0, 0, 0]
    crc_extra = 251
    unpacker = struct.Struct("<Q4IH4H4hBBBB")
    instance_field = "index"
    instance_offset = 42

    def __init__(self, index: int, time_usec: int, counter: int, count: int, connection_type: int, info: int, failure_flags: Sequence[int], error_count: Sequence[int], temperature: Sequence[int]):
        MAVLink_message.__init__(self, MAVLink_esc_info_message.id, MAVLink_esc_info_message.msgname)
        self._fieldnames = MAVLink_esc_info_message.fieldnames
        self._instance_field = MAVLink_esc_info_message.instance_field
        self._instance_offset = MAVLink_esc_info_message.instance_offset
        self.index = index
        self.time_usec = time_usec
        self.counter = counter
        self.count = count
        self.connection_type = connection_type
        self.info = info
        self.failure_flags = failure_flags
        self.error_count = error_count
        self.temperature = temperature

    def pack(self, mav: "MAVLink", force_mavlink1: bool = False) -> bytes:
        return self._pack(mav, self.crc_extra, self.unpacker.pack(self.time_usec, self.error_count[0], self.error_count[1], self.error_count[2], self.error_count[3], self.counter, self.failure_flags[0], self.failure_flags[1], self.failure_flags[2], self.failure_flags[3], self.temperature[0], self.temperature[1], self.temperature[2], self.temperature[3], self.index, self.count, self.connection_type, self.info), force_mavlink1=force_mavlink1)


# Define name on the class for backwards compatibility (it is now msgname).
# Done with setattr to hide the class variable from mypy.
setattr(MAVLink_esc_info_message, "name", mavlink_msg_deprecated_name_property())


class MAVLink_esc_status_message(MAVLink_message):
    """
    ESC information for higher rate streaming. Recommended streaming
    rate is ~10 Hz. Information that changes more slowly is sent in
    ESC_INFO. It should typically only be streamed on high-bandwidth
    links (i.e. to a companion computer).
    """

    id = MAVLINK_MSG_ID_ESC_STATUS
    msgname = "ESC_STATUS"
    fieldnames = ["index", "time_usec", "rpm", "voltage", "current"]
    ordered_fieldnames = ["time_usec", "rpm", "voltage", "current", "index"]
    fieldtypes = ["uint8_t", "uint64_t", "int32_t", "float", "float"]
    fielddisplays_by_name: Dict[str, str] = {}
    fieldenums_by_name: Dict[str, str] = {}
    fieldunits_by_name: Dict[str, str] = {"time_usec": "us", "rpm": "rpm", "voltage": "V", "current": "A"}
    native_format = bytearray(b"<QiffB")
    orders = [4, 0, 1, 2, 3]
    lengths = [1, 4, 4, 4, 1]
    array_lengths = [0, 4, 4, 4, 0]
    crc_extra = 10
    unpacker = struct.Struct("<Q4i4f4fB")
    instance_field = "index"
    instance_offset = 56

    def __init__(self, index: int, time_usec: int, rpm: Sequence[int], voltage: Sequence[float], current: Sequence[float]):
        MAVLink_message.__init__(self, MAVLink_esc_status_message.id, MAVLink_esc_status_message.msgname)
        self._fieldnames = MAVLink_esc_status_message.fieldnames
        self._instance_field = MAVLink_esc_status_message.instance_field
        self._instance_offset = MAVLink_esc_status_message.instance_offset
        self.index = index
        self.time_usec = time_usec
        self.rpm = rpm
        self.voltage = voltage
        self.current = current

    def pack(self, mav: "MAVLink", force_mavlink1: bool = False) -> bytes:
        return self._pack(mav, self.crc_extra, self.unpacker.pack(self.time_usec, self.rpm[0], self.rpm[1], self.rpm[2], self.rpm[3], self.voltage[0], self.voltage[1], self.voltage[2], self.voltage[3], self.current[0], self.current[1], self.current[2], self.current[3], self.index), force_mavlink1=force_mavlink1)


# Define name on the class for backwards compatibility (it is now msgname).
# Done with setattr to hide the class variable from mypy.
setattr(MAVLink_esc_status_message, "name", mavlink_msg_deprecated_name_property())


class MAVLink_protocol_version_message(MAVLink_message):
    """
    Version and capability of protocol version. This message can be
    requested with MAV_CMD_REQUEST_MESSAGE and is used as part of the
    handshaking to establish which MAVLink version should be used on
    the network. Every node should respond to a request for
    PROTOCOL_VERSION to enable the handshaking. Library implementers
    should consider adding this into the default decoding state
    machine to allow the protocol core to respond directly.
    """

    id = MAVLINK_MSG_ID_PROTOCOL_VERSION
    msgname = "PROTOCOL_VERSION"
    fieldnames = ["version", "min_version", "max_version", "spec_version_hash", "library_version_hash"]
    ordered_fieldnames = ["version", "min_version", "max_version", "spec_version_hash", "library_version_hash"]
    fieldtypes = ["uint16_t", "uint16_t", "uint16_t", "uint8_t", "uint8_t"]
    fielddisplays_by_name: Dict[str, str] = {}
    fieldenums_by_name: Dict[str, str] = {}
    fieldunits_by_name: Dict[str, str] = {}
    native_format = bytearray(b"<HHHBB")
    orders = [0, 1, 2, 3, 4]
    lengths = [1, 1, 1, 8, 8]
    array_lengths = [0, 0, 0, 8, 8]
    crc_extra = 217
    unpacker = struct.Struct("<HHH8B8B")
    instance_field = None
    instance_offset = -1

    def __init__(self, version: int, min_version: int, max_version: int, spec_version_hash: Sequence[int], library_version_hash: Sequence[int]):
        MAVLink_message.__init__(self, MAVLink_protocol_version_message.id, MAVLink_protocol_version_message.msgname)
        self._fieldnames = MAVLink_protocol_version_message.fieldnames
        self._instance_field = MAVLink_protocol_version_message.instance_field
        self._instance_offset = MAVLink_protocol_version_message.instance_offset
        self.version = version
        self.min_version = min_version
        self.max_version = max_version
        self.spec_version_hash = spec_version_hash
        self.library_version_hash = library_version_hash

    def pack(self, mav: "MAVLink", force_mavlink1: bool = False) -> bytes:
        return self._pack(mav, self.crc_extra, self.unpacker.pack(self.version, self.min_version, self.max_version, self.spec_version_hash[0], self.spec_version_hash[1], self.spec_version_hash[2], self.spec_version_hash[3], self.spec_version_hash[4], self.spec_version_hash[5], self.spec_version_hash[6], self.spec_version_hash[7], self.library_version_hash[0], self.library_version_hash[1], self.library_version_hash[2], self.library_version_hash[3], self.library_version_hash[4], self.library_version_hash[5], self.library_version_hash[6], self.library_version_hash[7]), force_mavlink1=force_mavlink1)


# Define name on the class for backwards compatibility (it is now msgname).
# Done with setattr to hide the class variable from mypy.
setattr(MAVLink_protocol_version_message, "name", mavlink_msg_deprecated_name_property())


class MAVLink_time_estimate_to_target_message(MAVLink_message):
    """
    Time/duration estimates for various events and actions given the
    current vehicle state and position.
    """

    id = MAVLINK_MSG_ID_TIME_ESTIMATE_TO_TARGET
    msgname = "TIME_ESTIMATE_TO_TARGET"
    fieldnames = ["safe_return", "land", "mission_next_item", "mission_end", "commanded_action"]
    ordered_fieldnames = ["safe_return", "land", "mission_next_item", "mission_end", "commanded_action"]
    fieldtypes = ["int32_t", "int32_t", "int32_t", "int32_t", "int32_t"]
    fielddisplays_by_name: Dict[str, str] = {}
    fieldenums_by_name: Dict[str, str] = {}
    fieldunits_by_name: Dict[str, str] = {"safe_return": "s", "land": "s", "mission_next_item": "s", "mission_end": "s", "commanded_action": "s"}
    native_format = bytearray(b"<iiiii")
    orders = [0, 1, 2, 3, 4]
    lengths = [1, 1, 1, 1, 1]
    array_lengths = [0, 0, 0, 0, 0]
    crc_extra = 232
    unpacker = struct.Struct("<iiiii")
    instance_field = None
    instance_offset = -1

    def __init__(self, safe_return: int, land: int, mission_next_item: int, mission_end: int, commanded_action: int):
        MAVLink_message.__init__(self, MAVLink_time_estimate_to_target_message.id, MAVLink_time_estimate_to_target_message.msgname)
        self._fieldnames = MAVLink_time_estimate_to_target_message.fieldnames
        self._instance_field = MAVLink_time_estimate_to_target_message.instance_field
        self._instance_offset = MAVLink_time_estimate_to_target_message.instance_offset
        self.safe_return = safe_return
        self.land = land
        self.mission_next_item = mission_next_item
        self.mission_end = mission_end
        self.commanded_action = commanded_action

    def pack(self, mav: "MAVLink", force_mavlink1: bool = False) -> bytes:
        return self._pack(mav, self.crc_extra, self.unpacker.pack(self.safe_return, self.land, self.mission_next_item, self.mission_end, self.commanded_action), force_mavlink1=force_mavlink1)


# Define name on the class for backwards compatibility (it is now msgname).
# Done with setattr to hide the class variable from mypy.
setattr(MAVLink_time_estimate_to_target_message, "name", mavlink_msg_deprecated_name_property())


class MAVLink_component_information_message(MAVLink_message):
    """
    Component information message, which may be requested using
    MAV_CMD_REQUEST_MESSAGE.
    """

    id = MAVLINK_MSG_ID_COMPONENT_INFORMATION
    msgname = "COMPONENT_INFORMATION"
    fieldnames = ["time_boot_ms", "general_metadata_file_crc", "general_metadata_uri", "peripherals_metadata_file_crc", "peripherals_metadata_uri"]
    ordered_fieldnames = ["time_boot_ms", "general_metadata_file_crc", "peripherals_metadata_file_crc", "general_metadata_uri", "peripherals_metadata_uri"]
    fieldtypes = ["uint32_t", "uint32_t", "char", "uint32_t", "char"]
    fielddisplays_by_name: Dict[str, str] = {}
    fieldenums_by_name: Dict[str, str] = {}
    fieldunits_by_name: Dict[str, str] = {"time_boot_ms": "ms"}
    native_format = bytearray(b"<IIIcc")
    orders = [0, 1, 3, 2, 4]
    lengths = [1, 1, 1, 1, 1]
    array_lengths = [0, 0, 0, 100, 100]
    crc_extra = 0
    unpacker = struct.Struct("<III100s100s")
    instance_field = None
    instance_offset = -1

    def __init__(self, time_boot_ms: int, general_metadata_file_crc: int, general_metadata_uri: bytes, peripherals_metadata_file_crc: int, peripherals_metadata_uri: bytes):
        MAVLink_message.__init__(self, MAVLink_component_information_message.id, MAVLink_component_information_message.msgname)
        self._fieldnames = MAVLink_component_information_message.fieldnames
        self._instance_field = MAVLink_component_information_message.instance_field
        self._instance_offset = MAVLink_component_information_message.instance_offset
        self.time_boot_ms = time_boot_ms
        self.general_metadata_file_crc = general_metadata_file_crc
        self._general_metadata_uri_raw = general_metadata_uri
        self.general_metadata_uri = general_metadata_uri.split(b"\x00", 1)[0].decode("ascii", errors="replace")
        self.peripherals_metadata_file_crc = peripherals_metadata_file_crc
        self._peripherals_metadata_uri_raw = peripherals_metadata_uri
        self.peripherals_metadata_uri = peripherals_metadata_uri.split(b"\x00", 1)[0].decode("ascii", errors="replace")

    def pack(self, mav: "MAVLink", force_mavlink1: bool = False) -> bytes:
        return self._pack(mav, self.crc_extra, self.unpacker.pack(self.time_boot_ms, self.general_metadata_file_crc, self.peripherals_metadata_file_crc, self._general_metadata_uri_raw, self._peripherals_metadata_uri_raw), force_mavlink1=force_mavlink1)


# Define name on the class for backwards compatibility (it is now msgname).
# Done with setattr to hide the class variable from mypy.
setattr(MAVLink_component_information_message, "name", mavlink_msg_deprecated_name_property())


class MAVLink_component_metadata_message(MAVLink_message):
    """
    Component metadata message, which may be requested using
    MAV_CMD_REQUEST_MESSAGE.          This contains the MAVLink FTP
    URI and CRC for the component's general metadata file.         The
    file must be hosted on the component, and may be xz compressed.
    The file CRC can be used for file caching.          The general
    metadata file can be read to get the locations of other metadata
    files (COMP_METADATA_TYPE) and translations, which may be hosted
    either on the vehicle or the internet.         For more
    information see:
    https://mavlink.io/en/services/component_information.html.
    Note: Camera components should use CAMERA_INFORMATION instead, and
    autopilots may use both this message and AUTOPILOT_VERSION.
    """

    id = MAVLINK_MSG_ID_COMPONENT_METADATA
    msgname = "COMPONENT_METADATA"
    fieldnames = ["time_boot_ms", "file_crc", "uri"]
    ordered_fieldnames = ["time_boot_ms", "file_crc", "uri"]
    fieldtypes = ["uint32_t", "uint32_t", "char"]
    fielddisplays_by_name: Dict[str, str] = {}
    fieldenums_by_name: Dict[str, str] = {}
    fieldunits_by_name: Dict[str, str] = {"time_boot_ms": "ms"}
    native_format = bytearray(b"<IIc")
    orders = [0, 1, 2]
    lengths = [1, 1, 1]
    array_lengths = [0, 0, 100]
    crc_extra = 182
    unpacker = struct.Struct("<II100s")
    instance_field = None
    instance_offset = -1

    def __init__(self, time_boot_ms: int, file_crc: int, uri: bytes):
        MAVLink_message.__init__(self, MAVLink_component_metadata_message.id, MAVLink_component_metadata_message.msgname)
        self._fieldnames = MAVLink_component_metadata_message.fieldnames
        self._instance_field = MAVLink_component_metadata_message.instance_field
        self._instance_offset = MAVLink_component_metadata_message.instance_offset
        self.time_boot_ms = time_boot_ms
        self.file_crc = file_crc
        self._uri_raw = uri
        self.uri = uri.split(b"\x00", 1)[0].decode("ascii", errors="replace")

    def pack(self, mav: "MAVLink", force_mavlink1: bool = False) -> bytes:
        return self._pack(mav, self.crc_extra, self.unpacker.pack(self.time_boot_ms, self.file_crc, self._uri_raw), force_mavlink1=force_mavlink1)


# Define name on the class for backwards compatibility (it is now msgname).
# Done with setattr to hide the class variable from mypy.
setattr(MAVLink_component_metadata_message, "name", mavlink_msg_deprecated_name_property())


class MAVLink_event_message(MAVLink_message):
    """
    Event message. Each new event from a particular component gets a
    new sequence number. The same message might be sent multiple times
    if (re-)requested. Most events are broadcast, some can be specific
    to a target component (as receivers keep track of the sequence for
    missed events, all events need to be broadcast. Thus we use
    destination_component instead of target_component).
    """

    id = MAVLINK_MSG_ID_EVENT
    msgname = "EVENT"
    fieldnames = ["destination_component", "destination_system", "id", "event_time_boot_ms", "sequence", "log_levels", "arguments"]
    ordered_fieldnames = ["id", "event_time_boot_ms", "sequence", "destination_component", "destination_system", "log_levels", "arguments"]
    fieldtypes = ["uint8_t", "uint8_t", "uint32_t", "uint32_t", "uint16_t", "uint8_t", "uint8_t"]
    fielddisplays_by_name: Dict[str, str] = {}
    fieldenums_by_name: Dict[str, str] = {}
    fieldunits_by_name: Dict[str, str] = {"event_time_boot_ms": "ms"}
    native_format = bytearray(b"<IIHBBBB")
    orders = [3, 4, 0, 1, 2, 5, 6]
    lengths = [1, 1, 1, 1, 1, 1, 40]
    array_lengths = [0, 0, 0, 0, 0, 0, 40]
    crc_extra = 160
    unpacker = struct.Struct("<IIHBBB40B")
    instance_field = None
    instance_offset = -1

    def __init__(self, destination_component: int, destination_system: int, id: int, event_time_boot_ms: int, sequence: int, log_levels: int, arguments: Sequence[int]):
        MAVLink_message.__init__(self, MAVLink_event_message.id, MAVLink_event_message.msgname)
        self._fieldnames = MAVLink_event_message.fieldnames
        self._instance_field = MAVLink_event_message.instance_field
        self._instance_offset = MAVLink_event_message.instance_offset
        self.destination_component = destination_component
        self.destination_system = destination_system
        self.id = id
        self.event_time_boot_ms = event_time_boot_ms
        self.sequence = sequence
        self.log_levels = log_levels
        self.arguments = arguments

    def pack(self, mav: "MAVLink", force_mavlink1: bool = False) -> bytes:
        return self._pack(mav, self.crc_extra, self.unpacker.pack(self.id, self.event_time_boot_ms, self.sequence, self.destination_component, self.destination_system, self.log_levels, self.arguments[0], self.arguments[1], self.arguments[2], self.arguments[3], self.arguments[4], self.arguments[5], self.arguments[6], self.arguments[7], self.arguments[8], self.arguments[9], self.arguments[10], self.arguments[11], self.arguments[12], self.arguments[13], self.arguments[14], self.arguments[15], self.arguments[16], self.arguments[17], self.arguments[18], self.arguments[19], self.arguments[20], self.arguments[21], self.arguments[22], self.arguments[23], self.arguments[24], self.arguments[25], self.arguments[26], self.arguments[27], self.arguments[28], self.arguments[29], self.arguments[30], self.arguments[31], self.arguments[32], self.arguments[33], self.arguments[34], self.arguments[35], self.arguments[36], self.arguments[37], self.arguments[38], self.arguments[39]), force_mavlink1=force_mavlink1)


# Define name on the class for backwards compatibility (it is now msgname).
# Done with setattr to hide the class variable from mypy.
setattr(MAVLink_event_message, "name", mavlink_msg_deprecated_name_property())


class MAVLink_current_event_sequence_message(MAVLink_message):
    """
    Regular broadcast for the current latest event sequence number for
    a component. This is used to check for dropped events.
    """

    id = MAVLINK_MSG_ID_CURRENT_EVENT_SEQUENCE
    msgname = "CURRENT_EVENT_SEQUENCE"
    fieldnames = ["sequence", "flags"]
    ordered_fieldnames = ["sequence", "flags"]
    fieldtypes = ["uint16_t", "uint8_t"]
    fielddisplays_by_name: Dict[str, str] = {"flags": "bitmask"}
    fieldenums_by_name: Dict[str, str] = {"flags": "MAV_EVENT_CURRENT_SEQUENCE_FLAGS"}
    fieldunits_by_name: Dict[str, str] = {}
    native_format = bytearray(b"<HB")
    orders = [0, 1]
    lengths = [1, 1]
    array_lengths = [0, 0]
    crc_extra = 106
    unpacker = struct.Struct("<HB")
    instance_field = None
    instance_offset = -1

    def __init__(self, sequence: int, flags: int):
        MAVLink_message.__init__(self, MAVLink_current_event_sequence_message.id, MAVLink_current_event_sequence_message.msgname)
        self._fieldnames = MAVLink_current_event_sequence_message.fieldnames
        self._instance_field = MAVLink_current_event_sequence_message.instance_field
        self._instance_offset = MAVLink_current_event_sequence_message.instance_offset
        self.sequence = sequence
        self.flags = flags

    def pack(self, mav: "MAVLink", force_mavlink1: bool = False) -> bytes:
        return self._pack(mav, self.crc_extra, self.unpacker.pack(self.sequence, self.flags), force_mavlink1=force_mavlink1)


# Define name on the class for backwards compatibility (it is now msgname).
# Done with setattr to hide the class variable from mypy.
setattr(MAVLink_current_event_sequence_message, "name", mavlink_msg_deprecated_name_property())


class MAVLink_request_event_message(MAVLink_message):
    """
    Request one or more events to be (re-)sent. If
    first_sequence==last_sequence, only a single event is requested.
    Note that first_sequence can be larger than last_sequence (because
    the sequence number can wrap). Each sequence will trigger an EVENT
    or EVENT_ERROR response.
    """

    id = MAVLINK_MSG_ID_REQUEST_EVENT
    msgname = "REQUEST_EVENT"
    fieldnames = ["target_system", "target_component", "first_sequence", "last_sequence"]
    ordered_fieldnames = ["first_sequence", "last_sequence", "target_system", "target_component"]
    fieldtypes = ["uint8_t", "uint8_t", "uint16_t", "uint16_t"]
    fielddisplays_by_name: Dict[str, str] = {}
    fieldenums_by_name: Dict[str, str] = {}
    fieldunits_by_name: Dict[str, str] = {}
    native_format = bytearray(b"<HHBB")
    orders = [2, 3, 0, 1]
    lengths = [1, 1, 1, 1]
    array_lengths = [0, 0, 0, 0]
    crc_extra = 33
    unpacker = struct.Struct("<HHBB")
    instance_field = None
    instance_offset = -1

    def __init__(self, target_system: int, target_component: int, first_sequence: int, last_sequence: int):
        MAVLink_message.__init__(self, MAVLink_request_event_message.id, MAVLink_request_event_message.msgname)
        self._fieldnames = MAVLink_request_event_message.fieldnames
        self._instance_field = MAVLink_request_event_message.instance_field
        self._instance_offset = MAVLink_request_event_message.instance_offset
        self.target_system = target_system
        self.target_component = target_component
        self.first_sequence = first_sequence
        self.last_sequence = last_sequence

    def pack(self, mav: "MAVLink", force_mavlink1: bool = False) -> bytes:
        return self._pack(mav, self.crc_extra, self.unpacker.pack(self.first_sequence, self.last_sequence, self.target_system, self.target_component), force_mavlink1=force_mavlink1)


# Define name on the class for backwards compatibility (it is now msgname).
# Done with setattr to hide the class variable from mypy.
setattr(MAVLink_request_event_message, "name", mavlink_msg_deprecated_name_property())


class MAVLink_response_event_error_message(MAVLink_message):
    """
    Response to a REQUEST_EVENT in case of an error (e.g. the event is
    not available anymore).
    """

    id = MAVLINK_MSG_ID_RESPONSE_EVENT_ERROR
    msgname = "RESPONSE_EVENT_ERROR"
    fieldnames = ["target_system", "target_component", "sequence", "sequence_oldest_available", "reason"]
    ordered_fieldnames = ["sequence", "sequence_oldest_available", "target_system", "target_component", "reason"]
    fieldtypes = ["uint8_t", "uint8_t", "uint16_t", "uint16_t", "uint8_t"]
    fielddisplays_by_name: Dict[str, str] = {}
    fieldenums_by_name: Dict[str, str] = {"reason": "MAV_EVENT_ERROR_REASON"}
    fieldunits_by_name: Dict[str, str] = {}
    native_format = bytearray(b"<HHBBB")
    orders = [2, 3, 0, 1, 4]
    lengths = [1, 1, 1, 1, 1]
    array_lengths = [0, 0, 0, 0, 0]
    crc_extra = 77
    unpacker = struct.Struct("<HHBBB")
    instance_field = None
    instance_offset = -1

    def __init__(self, target_system: int, target_component: int, sequence: int, sequence_oldest_available: int, reason: int):
        MAVLink_message.__init__(self, MAVLink_response_event_error_message.id, MAVLink_response_event_error_message.msgname)
        self._fieldnames = MAVLink_response_event_error_message.fieldnames
        self._instance_field = MAVLink_response_event_error_message.instance_field
        self._instance_offset = MAVLink_response_event_error_message.instance_offset
        self.target_system = target_system
        self.target_component = target_component
        self.sequence = sequence
        self.sequence_oldest_available = sequence_oldest_available
        self.reason = reason

    def pack(self, mav: "MAVLink", force_mavlink1: bool = False) -> bytes:
        return self._pack(mav, self.crc_extra, self.unpacker.pack(self.sequence, self.sequence_oldest_available, self.target_system, self.target_component, self.reason), force_mavlink1=force_mavlink1)


# Define name on the class for backwards compatibility (it is now msgname).
# Done with setattr to hide the class variable from mypy.
setattr(MAVLink_response_event_error_message, "name", mavlink_msg_deprecated_name_property())


mavlink_map: Dict[int, Type[MAVLink_message]] = {
    MAVLINK_MSG_ID_LINK_NODE_STATUS: MAVLink_link_node_status_message,
    MAVLINK_MSG_ID_ESC_INFO: MAVLink_esc_info_message,
    MAVLINK_MSG_ID_ESC_STATUS: MAVLink_esc_status_message,
    MAVLINK_MSG_ID_PROTOCOL_VERSION: MAVLink_protocol_version_message,
    MAVLINK_MSG_ID_TIME_ESTIMATE_TO_TARGET: MAVLink_time_estimate_to_target_message,
    MAVLINK_MSG_ID_COMPONENT_INFORMATION: MAVLink_component_information_message,
    MAVLINK_MSG_ID_COMPONENT_METADATA: MAVLink_component_metadata_message,
    MAVLINK_MSG_ID_EVENT: MAVLink_event_message,
    MAVLINK_MSG_ID_CURRENT_EVENT_SEQUENCE: MAVLink_current_event_sequence_message,
    MAVLINK_MSG_ID_REQUEST_EVENT: MAVLink_request_event_message,
    MAVLINK_MSG_ID_RESPONSE_EVENT_ERROR: MAVLink_response_event_error_message,
}
