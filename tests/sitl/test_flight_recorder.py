from datetime import UTC, datetime

from sitl.drone import flight_recorder
from sitl.storage import TemporaryStorage


def test_a_log_is_named_by_the_time_of_day():
    boot_us = int(datetime(2026, 11, 20, 14, 5, 50, tzinfo=UTC).timestamp() * 1e6)
    recorder = flight_recorder(TemporaryStorage(), boot_us)
    assert recorder._name_log(9_500_000) == ("log", "2026-11-20", "14_05_59.ulg")
