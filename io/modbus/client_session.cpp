#include "io/modbus/client_session.hpp"

#include <modbus/modbus.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <system_error>
#include <thread>
#include <utility>

#include "io/modbus/exception_tally.hpp"
#include "io/modbus/request_plan.hpp"
#include "io/modbus/require.hpp"

namespace hil::io::modbus {

namespace {

std::string exception_text(int code) {
  return std::string(exception_name(static_cast<std::size_t>(code))) + " (exception " + std::to_string(code) +
         ")";
}

std::string words_of(int error) {
  if (error == ECONNRESET || error == EPIPE) return "the other side closed the connection";
  return std::generic_category().message(error);
}

// A frame: transaction, protocol (0), length of the rest, unit; then function and data. All big-endian.
constexpr std::size_t transaction_at = 0, protocol_at = 2, length_at = 4, unit_at = 6, function_at = 7;
constexpr std::size_t exception_bytes = 2;  // from the function code on
constexpr std::uint8_t exception_flag = 0x80;

void put_word(std::span<std::uint8_t> bytes, std::size_t at, std::size_t word) {
  bytes[at] = static_cast<std::uint8_t>(word >> 8U);
  bytes[at + 1] = static_cast<std::uint8_t>(word & 0xFFU);
}

std::uint16_t word_of(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] << 8U | bytes[at + 1]);
}

std::uint8_t read_function(Table table) {
  switch (table) {
    case Table::coil:
      return MODBUS_FC_READ_COILS;
    case Table::discrete_input:
      return MODBUS_FC_READ_DISCRETE_INPUTS;
    case Table::holding:
      return MODBUS_FC_READ_HOLDING_REGISTERS;
    case Table::input:
      return MODBUS_FC_READ_INPUT_REGISTERS;
  }
  return 0;
}

/// False when the time is over.
bool wait_for(int socket, short what, std::chrono::steady_clock::time_point until) {
  const auto left =
      std::chrono::duration_cast<std::chrono::nanoseconds>(until - std::chrono::steady_clock::now());
  if (left.count() <= 0) return false;
  const timespec time{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
  pollfd watched{socket, what, 0};
  return ::ppoll(&watched, 1, &time, nullptr) != 0;  // after a signal the caller waits again
}

}  // namespace

void ClientSession::adopt(Descriptor socket) {
  socket_ = std::move(socket);
  fault_.clear();
}

void ClientSession::disconnect() noexcept {
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
    close_with(Reply::broken, "the other side sent bytes that answer no request");
  } else {
    close_with(Reply::broken, words_of(rc == 0 ? ECONNRESET : errno));
  }
  return false;
}

bool ClientSession::prepare() {
  if (connected()) return usable();
  fault_ = "not connected";
  return false;
}

Reply ClientSession::does_not_fit(const std::string& what) {
  return close_with(Reply::broken, "the reply does not fit the request: " + what);
}

Reply ClientSession::send_whole(std::size_t size, std::chrono::steady_clock::time_point until) {
  for (std::size_t sent = 0; sent < size;) {
    const ssize_t rc = ::send(socket_.get(), request_.data() + sent, size - sent, MSG_NOSIGNAL);
    if (rc >= 0) {
      sent += static_cast<std::size_t>(rc);
    } else if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) {
      return close_with(Reply::broken, words_of(errno));
    } else if (!wait_for(socket_.get(), POLLOUT, until)) {
      return close_with(Reply::timeout,
                        "the request could not be sent within " + in_milliseconds(limit_.length));
    }
  }
  return Reply::good;
}

Reply ClientSession::receive_up_to(std::size_t size, std::chrono::steady_clock::time_point until) {
  while (received_ < size) {
    const ssize_t rc = ::recv(socket_.get(), reply_.data() + received_, size - received_, MSG_DONTWAIT);
    if (rc > 0) {
      received_ += static_cast<std::size_t>(rc);
    } else if (rc == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) {
      return close_with(Reply::broken, words_of(rc == 0 ? ECONNRESET : errno));
    } else if (!wait_for(socket_.get(), POLLIN, until)) {
      return close_with(Reply::timeout, "no complete reply within " + in_milliseconds(limit_.length));
    }
  }
  return Reply::good;
}

/// Everything that the protocol makes the unit repeat must equal the request.
Reply ClientSession::check_head(std::size_t reply_bytes) {
  const std::uint8_t function = request_[function_at];
  const auto differs = [&](const char* what, int is, int wanted) {
    return does_not_fit(std::string(what) + ' ' + std::to_string(is) + ", not " + std::to_string(wanted));
  };
  if (word_of(reply_, transaction_at) != transaction_)
    return differs("transaction", word_of(reply_, transaction_at), transaction_);
  if (word_of(reply_, protocol_at) != 0) return differs("protocol", word_of(reply_, protocol_at), 0);
  if (reply_[unit_at] != unit_) return differs("unit identifier", reply_[unit_at], unit_);
  const bool exception = reply_[function_at] == (function | exception_flag);
  if (!exception && reply_[function_at] != function)
    return differs("function", reply_[function_at], function);
  const std::size_t wanted = 1 + (exception ? exception_bytes : reply_bytes);
  if (word_of(reply_, length_at) != wanted)
    return differs("length", word_of(reply_, length_at), static_cast<int>(wanted));
  if (!exception) return Reply::good;
  const int code = reply_[function_at + 1];
  if (code == 0 || code >= MODBUS_EXCEPTION_MAX)
    return close_with(Reply::broken, "the reply is an exception that the protocol does not have");
  fault_ = exception_text(code);
  exception_code_ = static_cast<std::uint8_t>(code);
  return Reply::exception;
}

Reply ClientSession::exchange(std::size_t request_bytes, std::size_t reply_bytes, const TimeLimit& limit) {
  if (!prepare()) return Reply::broken;
  limit_ = limit;
  received_ = 0;
  const auto began = std::chrono::steady_clock::now();
  const auto until = began + limit.left;
  if (interference_.is_silent) {
    if (waits_) std::this_thread::sleep_until(until);
    return close_with(Reply::timeout, "no complete reply within " + in_milliseconds(limit_.length));
  }
  if (interference_.exception != 0) {
    fault_ = exception_text(interference_.exception);
    exception_code_ = interference_.exception;
    return Reply::exception;
  }
  put_word(request_, transaction_at, ++transaction_);
  put_word(request_, protocol_at, 0);
  put_word(request_, length_at, 1 + request_bytes);
  request_[unit_at] = unit_;
  Reply reply = send_whole(function_at + request_bytes, until);
  if (reply == Reply::good) reply = receive_up_to(function_at + exception_bytes, until);
  if (reply == Reply::good) reply = check_head(reply_bytes);
  if (reply == Reply::good) reply = receive_up_to(function_at + reply_bytes, until);
  if (reply == Reply::good && interference_.delay.count() > 0 && waits_) reply = delay_reply(began);
  if (reply == Reply::good) fault_.clear();
  return reply;
}

Reply ClientSession::delay_reply(std::chrono::steady_clock::time_point began) {
  std::this_thread::sleep_until(
      std::min(began + limit_.left, std::chrono::steady_clock::now() + interference_.delay));
  if (std::chrono::steady_clock::now() < began + limit_.left) return Reply::good;
  return close_with(Reply::timeout, "no complete reply within " + in_milliseconds(limit_.length));
}

Reply ClientSession::read(Table table, std::uint16_t address, std::span<std::uint16_t> registers,
                          const TimeLimit& limit) {
  const bool bits = is_bit_table(table);
  require(!registers.empty() && registers.size() <= (bits ? max_bits_read : max_registers_read),
          "ClientSession::read: a number of addresses that no request can carry");
  const std::size_t data_bytes = bits ? (registers.size() + 7) / 8 : 2 * registers.size();
  request_[function_at] = read_function(table);
  put_word(request_, function_at + 1, address);
  put_word(request_, function_at + 3, registers.size());
  const Reply reply = exchange(5, 2 + data_bytes, limit);
  if (reply != Reply::good) return reply;
  if (reply_[function_at + 1] != data_bytes)
    return does_not_fit(std::to_string(reply_[function_at + 1]) + " bytes of data, not " +
                        std::to_string(data_bytes));
  const std::span data = std::span(reply_).subspan(function_at + 2);
  for (std::size_t i = 0; i < registers.size(); ++i) {
    registers[i] = bits ? static_cast<std::uint16_t>(data[i / 8] >> (i % 8) & 1U) : word_of(data, 2 * i);
  }
  return reply;
}

Reply ClientSession::write(Table table, std::uint16_t address, std::span<const std::uint16_t> registers,
                           const TimeLimit& limit) {
  const bool bits = is_bit_table(table);
  require(table == Table::coil || table == Table::holding,
          "ClientSession::write: this table can not be written");
  require(!registers.empty() && registers.size() <= (bits ? max_bits_written : max_registers_written),
          "ClientSession::write: a number of addresses that no request can carry");
  constexpr std::size_t echoed = 5;  // the reply repeats function, address, and value or count
  std::size_t request_bytes = echoed;
  put_word(request_, function_at + 1, address);
  if (registers.size() == 1) {
    request_[function_at] = bits ? MODBUS_FC_WRITE_SINGLE_COIL : MODBUS_FC_WRITE_SINGLE_REGISTER;
    const std::uint16_t word = registers.front();
    put_word(request_, function_at + 3, bits && word != 0 ? 0xFF00U : word);
  } else {
    request_[function_at] = bits ? MODBUS_FC_WRITE_MULTIPLE_COILS : MODBUS_FC_WRITE_MULTIPLE_REGISTERS;
    put_word(request_, function_at + 3, registers.size());
    const std::size_t data_bytes = bits ? (registers.size() + 7) / 8 : 2 * registers.size();
    request_[function_at + echoed] = static_cast<std::uint8_t>(data_bytes);
    const std::span data = std::span(request_).subspan(function_at + echoed + 1, data_bytes);
    std::fill(data.begin(), data.end(), std::uint8_t{0});
    for (std::size_t i = 0; i < registers.size(); ++i) {
      if (!bits) {
        put_word(data, 2 * i, registers[i]);
      } else if (registers[i] != 0) {
        data[i / 8] = static_cast<std::uint8_t>(data[i / 8] | 1U << (i % 8));
      }
    }
    request_bytes += 1 + data_bytes;
  }
  const Reply reply = exchange(request_bytes, echoed, limit);
  if (reply != Reply::good) return reply;
  const auto sent = request_.begin() + function_at;
  if (!std::equal(sent, sent + echoed, reply_.begin() + function_at))
    return does_not_fit("it repeats another address or value than was written");
  return reply;
}

}  // namespace hil::io::modbus
