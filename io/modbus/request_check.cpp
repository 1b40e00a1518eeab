#include "io/modbus/request_check.hpp"

#include <modbus/modbus.h>

#include "io/modbus/request_plan.hpp"

namespace hil::io::modbus {

namespace {

constexpr std::uint8_t sound = 0;
constexpr std::uint8_t illegal_function = MODBUS_EXCEPTION_ILLEGAL_FUNCTION;
constexpr std::uint8_t illegal_address = MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS;
constexpr std::uint8_t illegal_value = MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE;
constexpr std::uint16_t max_registers_written_and_read = 121;

using Pdu = std::span<const std::uint8_t>;  // function code first

std::uint16_t word_at(Pdu pdu, std::size_t position) noexcept {
  return static_cast<std::uint16_t>(static_cast<unsigned>(pdu[position]) << 8U | pdu[position + 1]);
}

bool bit_at(Pdu bytes, std::size_t bit) noexcept {
  return (bytes[bit / 8] >> (bit % 8) & 1U) != 0;
}

std::uint8_t check_read(Pdu pdu, Table table, std::uint16_t most, const RegisterBank& bank) noexcept {
  if (pdu.size() != 5) return illegal_value;
  const std::uint16_t count = word_at(pdu, 3);
  if (count == 0 || count > most) return illegal_value;
  return bank.readable(table, word_at(pdu, 1), count) ? sound : illegal_address;
}

std::uint8_t check_write_one(Pdu pdu, Table table, const RegisterBank& bank) noexcept {
  if (pdu.size() != 5) return illegal_value;
  const std::uint16_t value = word_at(pdu, 3);
  if (table == Table::coil && value != 0x0000 && value != 0xFF00) return illegal_value;
  return bank.writable(table, word_at(pdu, 1), 1) ? sound : illegal_address;
}

std::uint8_t check_write_many(Pdu pdu, Table table, std::uint16_t most, const RegisterBank& bank) noexcept {
  if (pdu.size() < 6) return illegal_value;
  const std::uint16_t count = word_at(pdu, 3);
  if (count == 0 || count > most) return illegal_value;
  const std::size_t bytes = table == Table::coil ? (count + 7U) / 8U : 2U * count;
  if (pdu[5] != bytes || pdu.size() != 6 + bytes) return illegal_value;
  return bank.writable(table, word_at(pdu, 1), count) ? sound : illegal_address;
}

std::uint8_t check_mask_write(Pdu pdu, const RegisterBank& bank) noexcept {
  if (pdu.size() != 7) return illegal_value;
  return bank.writable(Table::holding, word_at(pdu, 1), 1) ? sound : illegal_address;
}

std::uint8_t check_write_and_read(Pdu pdu, const RegisterBank& bank) noexcept {
  if (pdu.size() < 10) return illegal_value;
  const std::uint16_t read_count = word_at(pdu, 3);
  const std::uint16_t write_count = word_at(pdu, 7);
  if (read_count == 0 || read_count > max_registers_read) return illegal_value;
  if (write_count == 0 || write_count > max_registers_written_and_read) return illegal_value;
  if (pdu[9] != 2U * write_count || pdu.size() != 10U + 2U * write_count) return illegal_value;
  if (!bank.readable(Table::holding, word_at(pdu, 1), read_count)) return illegal_address;
  return bank.writable(Table::holding, word_at(pdu, 5), write_count) ? sound : illegal_address;
}

void store_registers(const RequestRange& range, Pdu data, RegisterBank& bank) noexcept {
  for (std::uint16_t i = 0; i < range.count; ++i)
    bank.set(range.table, static_cast<std::uint16_t>(range.address + i), word_at(data, 2U * i));
}

void store_bits(const RequestRange& range, Pdu data, RegisterBank& bank) noexcept {
  for (std::uint16_t i = 0; i < range.count; ++i)
    bank.set(range.table, static_cast<std::uint16_t>(range.address + i), bit_at(data, i) ? 1 : 0);
}

}  // namespace

FramingResult find_frame(std::span<const std::uint8_t> bytes) noexcept {
  // Checks each part of the header as soon as it has arrived, so that garbage is detected at once.
  if (bytes.size() >= 3 && bytes[2] != 0) return {Framing::invalid, 0};
  if (bytes.size() >= 4 && bytes[3] != 0) return {Framing::invalid, 0};
  if (bytes.size() < 6) return {Framing::incomplete, 0};
  const std::size_t length = word_at(bytes, 4);
  const std::size_t size = 6 + length;
  if (length < 2 || size > longest_frame) return {Framing::invalid, 0};
  if (bytes.size() < size) return {Framing::incomplete, 0};
  return {Framing::complete, size};
}

std::uint8_t check_request(std::span<const std::uint8_t> frame, const RegisterBank& bank) noexcept {
  const Pdu pdu = frame.subspan(header_size);
  switch (pdu[0]) {
    case MODBUS_FC_READ_COILS:
      return check_read(pdu, Table::coil, max_bits_read, bank);
    case MODBUS_FC_READ_DISCRETE_INPUTS:
      return check_read(pdu, Table::discrete_input, max_bits_read, bank);
    case MODBUS_FC_READ_HOLDING_REGISTERS:
      return check_read(pdu, Table::holding, max_registers_read, bank);
    case MODBUS_FC_READ_INPUT_REGISTERS:
      return check_read(pdu, Table::input, max_registers_read, bank);
    case MODBUS_FC_WRITE_SINGLE_COIL:
      return check_write_one(pdu, Table::coil, bank);
    case MODBUS_FC_WRITE_SINGLE_REGISTER:
      return check_write_one(pdu, Table::holding, bank);
    case MODBUS_FC_WRITE_MULTIPLE_COILS:
      return check_write_many(pdu, Table::coil, max_bits_written, bank);
    case MODBUS_FC_WRITE_MULTIPLE_REGISTERS:
      return check_write_many(pdu, Table::holding, max_registers_written, bank);
    case MODBUS_FC_REPORT_SLAVE_ID:
      return pdu.size() == 1 ? sound : illegal_value;
    case MODBUS_FC_MASK_WRITE_REGISTER:
      return check_mask_write(pdu, bank);
    case MODBUS_FC_WRITE_AND_READ_REGISTERS:
      return check_write_and_read(pdu, bank);
    default:
      // Also function 7 (read exception status), which is for serial lines and which libmodbus does not
      // answer.
      return illegal_function;
  }
}

std::optional<RequestRange> requested_range(std::span<const std::uint8_t> frame) noexcept {
  const Pdu pdu = frame.subspan(header_size);
  if (pdu.size() < 5) return std::nullopt;
  const auto range = [&](bool writes, Table table, std::uint16_t count) {
    return RequestRange{writes, table, word_at(pdu, 1), count};
  };
  switch (pdu[0]) {
    case MODBUS_FC_READ_COILS:
      return range(false, Table::coil, word_at(pdu, 3));
    case MODBUS_FC_READ_DISCRETE_INPUTS:
      return range(false, Table::discrete_input, word_at(pdu, 3));
    case MODBUS_FC_READ_HOLDING_REGISTERS:
      return range(false, Table::holding, word_at(pdu, 3));
    case MODBUS_FC_READ_INPUT_REGISTERS:
      return range(false, Table::input, word_at(pdu, 3));
    case MODBUS_FC_WRITE_SINGLE_COIL:
      return range(true, Table::coil, 1);
    case MODBUS_FC_WRITE_SINGLE_REGISTER:
    case MODBUS_FC_MASK_WRITE_REGISTER:
      return range(true, Table::holding, 1);
    case MODBUS_FC_WRITE_MULTIPLE_COILS:
      return range(true, Table::coil, word_at(pdu, 3));
    case MODBUS_FC_WRITE_MULTIPLE_REGISTERS:
      return range(true, Table::holding, word_at(pdu, 3));
    case MODBUS_FC_WRITE_AND_READ_REGISTERS:
      if (pdu.size() < 9) return std::nullopt;
      return RequestRange{true, Table::holding, word_at(pdu, 5), word_at(pdu, 7)};
    default:
      return std::nullopt;
  }
}

std::optional<RequestRange> written_range(std::span<const std::uint8_t> frame) noexcept {
  const std::optional<RequestRange> range = requested_range(frame);
  return range && range->writes ? range : std::nullopt;
}

std::optional<RequestRange> apply_writes(std::span<const std::uint8_t> frame, RegisterBank& bank) noexcept {
  const std::optional<RequestRange> range = written_range(frame);
  if (!range) return range;
  const Pdu pdu = frame.subspan(header_size);
  switch (pdu[0]) {
    case MODBUS_FC_WRITE_SINGLE_COIL:
      bank.set(range->table, range->address, word_at(pdu, 3) != 0 ? 1 : 0);
      break;
    case MODBUS_FC_WRITE_SINGLE_REGISTER:
      bank.set(range->table, range->address, word_at(pdu, 3));
      break;
    case MODBUS_FC_WRITE_MULTIPLE_COILS:
      store_bits(*range, pdu.subspan(6), bank);
      break;
    case MODBUS_FC_WRITE_MULTIPLE_REGISTERS:
      store_registers(*range, pdu.subspan(6), bank);
      break;
    case MODBUS_FC_MASK_WRITE_REGISTER: {
      const unsigned old = bank.get(range->table, range->address);
      const unsigned kept = word_at(pdu, 3);
      bank.set(range->table, range->address,
               static_cast<std::uint16_t>((old & kept) | (word_at(pdu, 5) & ~kept)));
      break;
    }
    default:
      store_registers(*range, pdu.subspan(10), bank);
  }
  return range;
}

}  // namespace hil::io::modbus
