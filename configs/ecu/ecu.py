#!/usr/bin/env python3
"""A speed limiter on CAN, as an ECU of the scenario ecu.yaml. Uses the standard library alone.

It reads VehicleSpeed (0x120) and Driver (0x220) and sends Limiter (0x320) every 10 ms. It is active while the
speed is above the driver's. When three frames of VehicleSpeed in a row have a wrong counter, checksum or
length, or none came for 50 ms, it reports a fault and is not active, until three right ones came in a row.

On a virtual bus ("unix:PATH") it is a station, in lock-step or in real time; otherwise the bus is the name of
a SocketCAN interface ("can0").
"""

import argparse
import select
import socket
import struct
import time

SPEED_ID, DRIVER_ID, LIMITER_ID = 0x120, 0x220, 0x320
TIME_MAGIC, HELLO_MAGIC = 0x544C4948, 0x484C4948
NOW, BARRIER, ACK = 1, 2, 3
FRAME = struct.Struct("=IB3x8s")
TIME = struct.Struct("=IIQqQ")


def crc8_sae_j1850(data):
    crc = 0xFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x1D if crc & 0x80 else crc << 1) & 0xFF
    return crc ^ 0xFF


class Limiter:
    """The application: frames in, frames out. Times are in nanoseconds."""

    PERIOD = 10_000_000
    TIMEOUT = 50_000_000

    def __init__(self, reaction_delay):
        self.reaction_delay = reaction_delay
        self.set_speed = 250.0
        self.mode = 1
        self.speed = 0.0
        self.counter = None
        self.wrong = 3
        self.right = 0
        self.last_frame = None
        self.fault = True
        self.above_since = None
        self.next_send = None

    def on_frame(self, identifier, payload, now):
        if identifier == DRIVER_ID and len(payload) >= 2:
            self.set_speed, self.mode = float(payload[0]), payload[1] & 3
        elif identifier == SPEED_ID:
            self.on_speed(payload, now)

    def on_speed(self, payload, now):
        self.last_frame = now
        good = len(payload) == 8
        if good:
            good = payload[7] == crc8_sae_j1850(bytes([SPEED_ID & 0xFF]) + payload[:7] + b"\0")
        if good:
            counter = payload[6] & 15
            good = self.counter is None or counter == (self.counter + 1) % 16
            self.counter = counter
        self.right = self.right + 1 if good else 0
        self.wrong = 0 if good else self.wrong + 1
        if good:
            self.speed = 0.01 * int.from_bytes(payload[:2], "little")
        if self.wrong >= 3:
            self.fault = True
        elif self.right >= 3:
            self.fault = False
        is_above = self.speed > self.set_speed and self.mode == 1
        if not is_above:
            self.above_since = None
        elif self.above_since is None:
            self.above_since = now

    def due_frame(self, now):
        """The frame to send now, or None."""
        if self.next_send is None:
            self.next_send = now
        if now < self.next_send:
            return None
        self.next_send += ((now - self.next_send) // self.PERIOD + 1) * self.PERIOD
        if self.last_frame is None or now - self.last_frame > self.TIMEOUT:
            self.fault, self.right = True, 0
        reacts = self.above_since is not None and now - self.above_since >= self.reaction_delay
        active = reacts and not self.fault
        raw = round(100 * self.speed)
        return LIMITER_ID, bytes([active | self.fault << 1, raw & 0xFF, raw >> 8, 0])


def frame_bytes(identifier, payload):
    return FRAME.pack(identifier, len(payload), payload.ljust(8, b"\0"))


def frame_of(packet):
    identifier, length, data = FRAME.unpack(packet)
    return identifier & 0x1FFFFFFF, data[:length]


def run_station(path, limiter, lockstep):
    station = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    station.connect(path)
    station.send(struct.pack("=II56s", HELLO_MAGIC, 1, b"limiter"))
    now = None
    while True:
        if not lockstep:
            select.select([station], [], [], 0.001)
            now = time.monotonic_ns()
        try:
            packet = station.recv(128, socket.MSG_DONTWAIT if not lockstep else 0)
        except BlockingIOError:
            packet = None
        if packet == b"":
            return
        if packet is not None and len(packet) == FRAME.size:
            limiter.on_frame(*frame_of(packet), now)
        elif packet is not None and len(packet) == TIME.size:
            magic, kind, sequence, run_time, _ = TIME.unpack(packet)
            if magic != TIME_MAGIC:
                continue
            now = run_time
            if kind == BARRIER:
                if frame := limiter.due_frame(now):
                    station.send(frame_bytes(*frame))
                station.send(TIME.pack(TIME_MAGIC, ACK, sequence, now, 0))
        if not lockstep and (frame := limiter.due_frame(now)):
            station.send(frame_bytes(*frame))


def run_interface(name, limiter):
    bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    bus.bind((name,))
    while True:
        readable, _, _ = select.select([bus], [], [], 0.001)
        now = time.monotonic_ns()
        if readable:
            limiter.on_frame(*frame_of(bus.recv(FRAME.size)), now)
        if frame := limiter.due_frame(now):
            bus.send(frame_bytes(*frame))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bus", required=True, help="unix:PATH of a virtual bus, or a CAN interface")
    parser.add_argument("--clock", choices=["wall", "stepped"], default="wall")
    parser.add_argument("--late", type=int, default=0, metavar="MS", help="react so many milliseconds late")
    options = parser.parse_args()
    limiter = Limiter(options.late * 1_000_000)
    if options.bus.startswith("unix:"):
        run_station(options.bus[5:], limiter, options.clock == "stepped")
    else:
        run_interface(options.bus, limiter)


if __name__ == "__main__":
    try:
        main()
    except (KeyboardInterrupt, BrokenPipeError, ConnectionResetError):
        pass
