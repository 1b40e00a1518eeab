#include "io/modbus/client_session.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <new>
#include <system_error>
#include <utility>

#include "io/modbus/request_plan.hpp"
#include "io/modbus/require.hpp"

namespace hil::io::modbus {

namespace {

std::string exception_text(int code) {
  constexpr std::array<const char*, 12> names{"",
                                              "illegal function",
                                              "illegal data address",
                                              "illegal data value",
                                              "unit failure",
                                              "acknowledged, still working",
                                              "unit busy",
                                              "negative acknowledgement",
                                              "memory parity error",
                                              "undefined",
                                              "gateway path unavailable",
                                              "the unit behind the gateway does not answer"};
  return std::string(names.at(static_cast<std::size_t>(code))) + " (exception " + std::to_string(code) + ")";
}

bool is_exception(int error) {
  return error > MODBUS_ENOBASE && error < MODBUS_ENOBASE + MODBUS_EXCEPTION_MAX;
}

std::string words_of(int error) {
  if (error == EMBBADEXC) return "the reply is an exception that the protocol does not have";
  if (error == EMBBADDATA) return "the reply does not fit the request";
  if (error == ECONNRESET || error == EPIPE) return "the other side closed the connection";
  return std::generic_category().message(error);
}

}  // namespace

ClientSession::ClientSession(std::uint8_t unit)
    // The address is never used: only connected sockets are handed over.
    : context_(modbus_new_tcp_pi("127.0.0.1", "502")) {
  if (context_ == nullptr) throw std::bad_alloc();
  require(modbus_set_slave(context_.get(), unit) == 0,
          "ClientSession: the unit identifier is not 0..247 or 255");
  modbus_set_byte_timeout(context_.get(), 0, 0);
}

void ClientSession::adopt(Descriptor socket) {
  socket_ = std::move(socket);
  modbus_set_socket(context_.get(), socket_.get());
  fault_.clear();
}

void ClientSession::disconnect() noexcept {
  modbus_set_socket(context_.get(), -1);
  socket_.reset();
}

Reply ClientSession::close_with(Reply reply, std::string fault) {
  disconnect();
  fault_ = std::move(fault);
  return reply;
}

bool ClientSession::usable() {
  std::uint8_t byte = 0;
  const ssize_t rc = ::recv(socket_.get(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
  if (rc < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return true;
  if (rc > 0) {
    close_with(Reply::broken, "the other side sent bytes that nobody asked for");
  } else {
    close_with(Reply::broken, words_of(rc == 0 ? ECONNRESET : errno));
  }
  return false;
}

bool ClientSession::prepare(std::chrono::microseconds limit) {
  if (!connected()) {
    fault_ = "not connected";
    return false;
  }
  if (!usable()) return false;
  // libmodbus takes no time-out of zero.
  const auto microseconds = static_cast<std::uint64_t>(std::max<std::int64_t>(limit.count(), 1));
  constexpr std::uint64_t second = 1'000'000;
  require(modbus_set_response_timeout(context_.get(), static_cast<std::uint32_t>(microseconds / second),
                                      static_cast<std::uint32_t>(microseconds % second)) == 0,
          "ClientSession: libmodbus refused the response time-out");
  return true;
}

Reply ClientSession::outcome_of(int rc, int wanted, std::chrono::microseconds limit) {
  const int error = errno;
  if (rc == wanted) {
    fault_.clear();
    return Reply::good;
  }
  if (rc >= 0) return close_with(Reply::broken, words_of(EMBBADDATA));
  if (is_exception(error)) {
    fault_ = exception_text(error - MODBUS_ENOBASE);
    return Reply::exception;
  }
  if (error == ETIMEDOUT) {
    return close_with(Reply::timeout, "no whole reply within " + std::to_string(limit.count()) + " us");
  }
  return close_with(Reply::broken, words_of(error));
}

Reply ClientSession::read(Table table, std::uint16_t address, std::span<std::uint16_t> registers,
                          std::chrono::microseconds limit) {
  require(
      !registers.empty() && registers.size() <= (is_bit_table(table) ? max_bits_read : max_registers_read),
      "ClientSession::read: a number of addresses that no request can carry");
  if (!prepare(limit)) return Reply::broken;
  const int count = static_cast<int>(registers.size());
  if (table == Table::holding) {
    return outcome_of(modbus_read_registers(context_.get(), address, count, registers.data()), count, limit);
  }
  if (table == Table::input) {
    return outcome_of(modbus_read_input_registers(context_.get(), address, count, registers.data()), count,
                      limit);
  }
  std::array<std::uint8_t, max_bits_read> bits{};
  const int rc = table == Table::coil ? modbus_read_bits(context_.get(), address, count, bits.data())
                                      : modbus_read_input_bits(context_.get(), address, count, bits.data());
  const Reply reply = outcome_of(rc, count, limit);
  std::copy_n(bits.begin(), registers.size(), registers.begin());
  return reply;
}

Reply ClientSession::write(Table table, std::uint16_t address, std::span<const std::uint16_t> registers,
                           std::chrono::microseconds limit) {
  require(table == Table::coil || table == Table::holding,
          "ClientSession::write: this table can not be written");
  require(!registers.empty() &&
              registers.size() <= (is_bit_table(table) ? max_bits_written : max_registers_written),
          "ClientSession::write: a number of addresses that no request can carry");
  if (!prepare(limit)) return Reply::broken;
  const int count = static_cast<int>(registers.size());
  if (table == Table::holding) {
    const int rc = count == 1 ? modbus_write_register(context_.get(), address, registers.front())
                              : modbus_write_registers(context_.get(), address, count, registers.data());
    return outcome_of(rc, count, limit);
  }
  if (count == 1)
    return outcome_of(modbus_write_bit(context_.get(), address, registers.front() != 0), 1, limit);
  std::array<std::uint8_t, max_bits_written> bits{};
  std::transform(registers.begin(), registers.end(), bits.begin(),
                 [](std::uint16_t word) { return static_cast<std::uint8_t>(word != 0); });
  return outcome_of(modbus_write_bits(context_.get(), address, count, bits.data()), count, limit);
}

}  // namespace hil::io::modbus
