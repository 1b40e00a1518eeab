"""A Modbus TCP unit by pymodbus, the peer of a test. Prints 'listening 127.0.0.1:PORT' and serves.

Every table has 200 addresses; register i starts at 100 + i, bit i at i % 2. With the argument "sparse" the
holding registers are 0, 5 and 20 only.
"""
import asyncio
import logging
import sys

from pymodbus.datastore import (
    ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext, ModbusSparseDataBlock)
from pymodbus.server.async_io import ModbusTcpServer

logging.disable(logging.CRITICAL)  # the test kills this, and that is no error


async def main():
    registers = [100 + i for i in range(200)]
    bits = [i % 2 == 1 for i in range(200)]
    holding = (ModbusSparseDataBlock({i: registers[i] for i in (0, 5, 20)}) if sys.argv[1:] == ["sparse"]
               else ModbusSequentialDataBlock(0, list(registers)))
    unit = ModbusSlaveContext(
        di=ModbusSequentialDataBlock(0, list(bits)), co=ModbusSequentialDataBlock(0, list(bits)),
        hr=holding, ir=ModbusSequentialDataBlock(0, list(registers)),
        zero_mode=True)
    server = ModbusTcpServer(ModbusServerContext(slaves=unit, single=True), address=("127.0.0.1", 0))
    serving = asyncio.ensure_future(server.serve_forever())
    await server.serving
    print(f"listening 127.0.0.1:{server.server.sockets[0].getsockname()[1]}", flush=True)
    await serving


asyncio.run(main())
