"""Reads the fields of a log for verify_log.py."""
import struct


class Refused(Exception):
    pass


def check(condition, why):
    if not condition:
        raise Refused(why)


class Cursor:
    """Reads fields one after the other, never past the end."""

    def __init__(self, data, at=0):
        self.data, self.at = data, at

    def get(self, layout):
        size = struct.calcsize("<" + layout)
        check(self.at + size <= len(self.data), "cut short")
        values = struct.unpack_from("<" + layout, self.data, self.at)
        self.at += size
        return values

    def take(self, count):
        check(self.at + count <= len(self.data), "cut short")
        self.at += count
        return self.data[self.at - count:self.at]

    def skip_zeros(self, unit):
        while self.at % unit:
            check(self.take(1) == b"\0", "not padded with zeros")

    def left(self):
        return len(self.data) - self.at
