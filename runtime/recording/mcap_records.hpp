#pragma once
// The records of MCAP as bytes: little-endian numbers, texts and lists with their length before them. For the
// writer; https://mcap.dev/spec names the fields.

#include <bit>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace hil::recording::mcap {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they are in memory");

inline constexpr std::string_view magic{"\x89MCAP0\r\n", 8};

enum class Op : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  metadata = 0x0C,
  metadata_index = 0x0D,
  summary_offset = 0x0E,
  data_end = 0x0F,
};

/// Before the content of a record: its opcode and the length of the content.
inline constexpr std::size_t record_head = 9;

template <std::unsigned_integral Number>
void append(std::string& bytes, Number number) {
  char raw[sizeof number];
  std::memcpy(raw, &number, sizeof number);
  bytes.append(raw, sizeof number);
}

inline void append_text(std::string& bytes, std::string_view text) {
  append(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += text;
}

/// Appends a record whose content `content(bytes)` appends.
template <typename Content>
void append_record(std::string& bytes, Op op, const Content& content) {
  bytes += static_cast<char>(op);
  const std::size_t length_at = bytes.size();
  append(bytes, std::uint64_t{0});
  content(bytes);
  const std::uint64_t length = bytes.size() - length_at - sizeof(std::uint64_t);
  std::memcpy(bytes.data() + length_at, &length, sizeof length);
}

}  // namespace hil::recording::mcap
