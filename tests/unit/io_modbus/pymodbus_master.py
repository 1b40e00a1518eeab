"""A Modbus TCP client by pymodbus, the other side of a test: python3 pymodbus_master.py PORT.

The server has, in this order of addresses: holding 0..3 'a' (u64, clients write), input 0..3 'b'
(f64, 1234.5), coils 0..9 (clients write). Exits with 0 when every function gave the expected reply, and
prints which ones did not.
"""
import struct
import sys

from pymodbus.client import ModbusTcpClient

failures = []


def expect(what, got, wanted):
    if got != wanted:
        failures.append(f"{what}: got {got!r}, wanted {wanted!r}")


client = ModbusTcpClient("127.0.0.1", port=int(sys.argv[1]), timeout=5)
if not client.connect():
    sys.exit("no connection")
expect("write registers", client.write_registers(0, [1, 2, 3, 4], slave=1).isError(), False)
expect("read holding", client.read_holding_registers(0, 4, slave=1).registers, [1, 2, 3, 4])
expect("write register", client.write_register(2, 0xABCD, slave=1).value, 0xABCD)
expect("mask write", client.mask_write_register(2, 0x00FF, 0x1200, slave=1).isError(), False)
expect("after mask write", client.read_holding_registers(2, 1, slave=1).registers, [0x12CD])
both = client.readwrite_registers(
    read_address=0, read_count=4, write_address=3, write_registers=[77], slave=1)
expect("read and write", both.registers, [1, 2, 0x12CD, 77])
words = client.read_input_registers(0, 4, slave=1).registers
expect("read input", struct.unpack(">d", struct.pack(">4H", *words))[0], 1234.5)
expect("write coil", client.write_coil(9, True, slave=1).isError(), False)
expect("write coils", client.write_coils(0, [True, False, True], slave=1).isError(), False)
expect("read coils", client.read_coils(0, 10, slave=1).bits[:10], [True, False, True] + [False] * 6 + [True])
expect("beyond the end", client.read_holding_registers(0, 5, slave=1).exception_code, 2)
expect("write what is not there", client.write_register(4, 1, slave=1).exception_code, 2)
for unit in (0, 42, 247, 248, 250, 254, 255):
    expect(f"unit identifier {unit}", client.read_holding_registers(0, 1, slave=unit).registers, [1])
client.close()
if failures:
    sys.exit("\n".join(failures))
