#include "io/can/candump_line.hpp"

#include <array>
#include <charconv>
#include <cstdio>

namespace hil::io::can {
namespace {

constexpr std::string_view hex_digits = "0123456789ABCDEF";
constexpr std::int64_t ns_per_second = 1'000'000'000;

void append_hex(std::string& text, std::uint32_t value, int digits) {
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) {
    text.push_back(hex_digits[(value >> static_cast<unsigned>(shift)) & 0xFU]);
  }
}

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

bool has_only_hex_digits(std::string_view text) {
  for (const char c : text)
    if (hex_value(c) < 0) return false;
  return true;
}

/// Reads the fields of a line, from the left. Each function is false with the mistake of its field.
class LineParser {
 public:
  explicit LineParser(std::string_view line) : line_(line) {
    while (!line_.empty() && (line_.back() == '\r' || line_.back() == '\n' || line_.back() == ' '))
      line_.remove_suffix(1);
  }

  bool parse() { return take_time() && take_interface() && take_frame(); }
  LoggedFrame& logged() { return logged_; }
  CandumpMistake mistake() const { return mistake_; }

 private:
  bool refuse(std::string_view field, const char* text) {
    mistake_ = {.column = static_cast<std::size_t>(field.data() - line_.data()) + 1, .text = text};
    return false;
  }

  bool take_time() {
    if (!line_.starts_with('(')) return refuse(line_, "the line does not begin with a time in parentheses");
    const std::size_t close = line_.find(')');
    if (close == std::string_view::npos) return refuse(line_, "the parenthesis of the time does not close");
    const std::string_view text = line_.substr(1, close - 1);
    const std::size_t dot = text.find('.');
    if (dot == std::string_view::npos || text.size() - dot - 1 != 6)
      return refuse(text, "the time does not have six decimals");
    std::int64_t seconds = 0;
    std::uint32_t microseconds = 0;
    const char* const end = text.data() + text.size();
    const auto whole = std::from_chars(text.data(), text.data() + dot, seconds);
    const auto part = std::from_chars(text.data() + dot + 1, end, microseconds);
    if (whole.ec == std::errc::invalid_argument || whole.ptr != text.data() + dot || part.ec != std::errc{} ||
        part.ptr != end)
      return refuse(text, "the time is no number of seconds");
    if (whole.ec != std::errc{} || seconds < 0 || seconds > INT64_MAX / ns_per_second - 1)
      return refuse(text, "the time is below 0 s or beyond the year 2262");
    logged_.frame.wall_ns = seconds * ns_per_second + std::int64_t{microseconds} * 1000;
    logged_.frame.time_ns = logged_.frame.wall_ns;
    rest_ = line_.substr(close + 1);
    return rest_.starts_with(' ') || refuse(rest_, "the time is not followed by one space and an interface");
  }

  bool take_interface() {
    rest_.remove_prefix(1);
    const std::size_t space = rest_.find(' ');
    if (space == 0 || rest_.empty())
      return refuse(rest_, "the time is not followed by one space and an interface");
    if (space == std::string_view::npos)
      return refuse(rest_.substr(rest_.size()), "no frame follows the interface");
    logged_.interface = rest_.substr(0, space);
    rest_.remove_prefix(space + 1);
    return true;
  }

  bool take_frame() {
    const std::size_t end = rest_.find(' ');
    if (end != std::string_view::npos && rest_.substr(end) == " T") logged_.frame.direction = Direction::tx;
    const std::string_view text = rest_.substr(0, end);
    const std::size_t mark = text.find('#');
    if (mark == std::string_view::npos)
      return refuse(text, "the frame has no '#' between identifier and payload");
    return take_identifier(text.substr(0, mark)) && take_content(text.substr(mark + 1));
  }

  bool take_identifier(std::string_view text) {
    if ((text.size() != 3 && text.size() != 8) || !has_only_hex_digits(text))
      return refuse(text, "the identifier does not have 3 or 8 hexadecimal digits");
    canid_t& can_id = logged_.frame.raw.can_id;
    std::from_chars(text.data(), text.data() + text.size(), can_id, 16);
    if (text.size() == 3)
      return can_id <= CAN_SFF_MASK || refuse(text, "the identifier of 3 digits is above 7FF");
    if ((can_id & CAN_ERR_FLAG) == 0) can_id |= CAN_EFF_FLAG;
    return (can_id & CAN_RTR_FLAG) == 0 || refuse(text, "the identifier of 8 digits is above 1FFFFFFF");
  }

  bool take_content(std::string_view content) {
    Frame& frame = logged_.frame;
    if (content.starts_with('#')) {
      content.remove_prefix(1);
      if (content.empty() || hex_value(content.front()) < 0)
        return refuse(content, "'##' is not followed by a hexadecimal digit, the flags of a CAN FD frame");
      frame.is_fd = true;
      frame.raw.flags = static_cast<std::uint8_t>(hex_value(content.front()));
      content.remove_prefix(1);
    }
    const std::string_view whole = content;
    if (!take_length_code(content)) return false;
    const bool is_remote = !frame.is_fd && (content.starts_with('R') || content.starts_with('r'));
    if (is_remote ? !take_remote_length(content) : !take_payload(content)) return false;
    const bool has_length_code = !frame.is_fd && frame.raw.__res1 != 0;
    return !has_length_code || frame.raw.len == CAN_MAX_DLEN ||
           refuse(whole.substr(content.size()),
                  "only a classic frame of 8 bytes can have a data length code");
  }

  /// Removes the suffix `_C` of a classic frame of 8 bytes, where C is its data length code, 9 to F.
  bool take_length_code(std::string_view& text) {
    const std::size_t mark = text.find('_');
    if (mark == std::string_view::npos) return true;
    const std::string_view suffix = text.substr(mark);
    const int code = suffix.size() == 2 ? hex_value(suffix[1]) : -1;
    text = text.substr(0, mark);
    if (logged_.frame.is_fd) return refuse(suffix, "a CAN FD frame has no data length code");
    if (code <= CAN_MAX_DLEN) return refuse(suffix, "the data length code is not one digit from 9 to F");
    logged_.frame.raw.__res1 = static_cast<std::uint8_t>(code);  // can_frame::len8_dlc
    return true;
  }

  bool take_remote_length(std::string_view text) {
    canfd_frame& raw = logged_.frame.raw;
    raw.can_id |= CAN_RTR_FLAG;
    if (text.size() == 1) return true;
    const int length = hex_value(text[1]);
    if (text.size() != 2 || length < 0 || length > CAN_MAX_DLEN)
      return refuse(text, "the length behind 'R' is not one digit from 0 to 8");
    raw.len = static_cast<std::uint8_t>(length);
    return true;
  }

  bool take_payload(std::string_view text) {
    Frame& frame = logged_.frame;
    if (!has_only_hex_digits(text))
      return refuse(text, "the payload has a character that is no hexadecimal digit");
    if (text.size() % 2 != 0) return refuse(text, "the payload has an odd number of hexadecimal digits");
    const std::size_t bytes = text.size() / 2;
    if (!frame.is_fd && bytes > CAN_MAX_DLEN)
      return refuse(text,
                    "the payload of a classic frame has more than 8 bytes; that of CAN FD is behind '##'");
    if (bytes > CANFD_MAX_DLEN || !valid_length(bytes, frame.is_fd))
      return refuse(text,
                    "the payload of a CAN FD frame has a length other than 0 to 8, 12, 16, 20, 24, 32, 48 "
                    "and 64 bytes");
    for (std::size_t index = 0; index < bytes; ++index)
      frame.raw.data[index] =
          static_cast<std::uint8_t>(hex_value(text[2 * index]) * 16 + hex_value(text[2 * index + 1]));
    frame.raw.len = static_cast<std::uint8_t>(bytes);
    return true;
  }

  std::string_view line_, rest_;
  LoggedFrame logged_;
  CandumpMistake mistake_;
};

}  // namespace

void append_candump_line(std::string& text, const Frame& frame, std::string_view interface) {
  std::array<char, 48> time{};
  const int length = std::snprintf(time.data(), time.size(), "(%010lld.%06lld) ",
                                   static_cast<long long>(frame.wall_ns / ns_per_second),
                                   static_cast<long long>(frame.wall_ns % ns_per_second / 1000));
  text.append(time.data(), static_cast<std::size_t>(length)).append(interface).push_back(' ');
  if (frame.is_error()) {
    append_hex(text, frame.raw.can_id & (CAN_ERR_MASK | CAN_ERR_FLAG), 8);
  } else {
    append_hex(text, frame.identifier(), frame.is_extended() ? 8 : 3);
  }
  text.push_back('#');
  if (frame.is_fd) {
    text.push_back('#');
    append_hex(text, frame.raw.flags & 0xFU, 1);
  }
  if (frame.is_remote()) {
    text.push_back('R');
    if (frame.raw.len > 0) append_hex(text, frame.raw.len, 1);
    return;
  }
  for (const std::uint8_t byte : frame.payload())
    append_hex(text, byte, 2);
}

std::optional<LoggedFrame> parse_candump_line(std::string_view line, CandumpMistake* mistake) {
  LineParser parser(line);
  if (parser.parse()) return std::move(parser.logged());
  if (mistake != nullptr) *mistake = parser.mistake();
  return std::nullopt;
}

}  // namespace hil::io::can
