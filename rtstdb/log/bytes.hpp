#pragma once
// Writes structs to bytes and reads them back, one after the other. Reading never passes the end.

#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>

#include <rtstdb/result.hpp>

#include "rtstdb/log/checksum.hpp"
#include "rtstdb/log/format.hpp"

namespace rtstdb::log {

class ByteWriter {
 public:
  /// Misuse: to write more than `room` holds.
  explicit ByteWriter(std::span<std::byte> space) : space_(space) {}

  /// Writes several structs in one call, so that their offsets are compile-time constants.
  template <class... Structs>
  void put(const Structs&... values) noexcept {
    static_assert(
        ((std::has_unique_object_representations_v<Structs> || std::is_standard_layout_v<Structs>)&&...));
    static_assert((std::is_trivially_copyable_v<Structs> && ...));
    std::byte* at = next((sizeof(Structs) + ...));
    ((std::memcpy(at, &values, sizeof values), at += sizeof values), ...);
  }
  /// Reserves room for `bytes` bytes, which the caller fills.
  std::byte* next(std::size_t bytes) noexcept {
    RTSTDB_ASSERT(bytes <= space_.size() - count_, "the bytes exceed the space");
    return space_.data() + std::exchange(count_, count_ + bytes);
  }
  void put_bytes(std::span<const std::byte> bytes) noexcept {
    RTSTDB_ASSERT(bytes.size() <= space_.size() - count_, "the bytes exceed the space");
    if (!bytes.empty()) std::memcpy(space_.data() + count_, bytes.data(), bytes.size());
    count_ += bytes.size();
  }
  void pad_to(std::size_t unit) noexcept {
    const std::size_t end = round_up(count_, unit);
    RTSTDB_ASSERT(end <= space_.size(), "the bytes exceed the space");
    std::memset(space_.data() + count_, 0, end - count_);
    count_ = end;
  }
  std::size_t count() const noexcept { return count_; }

 private:
  std::span<std::byte> space_;
  std::size_t count_ = 0;
};

class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  /// False: not enough bytes left; nothing is read.
  template <class Struct>
  [[nodiscard]] bool get(Struct& value) noexcept {
    static_assert(std::is_trivially_copyable_v<Struct>);
    if (left() < sizeof(Struct)) return false;
    std::memcpy(static_cast<void*>(&value), bytes_.data() + count_, sizeof(Struct));
    count_ += sizeof(Struct);
    return true;
  }
  [[nodiscard]] bool get_bytes(std::size_t count, std::span<const std::byte>& bytes) noexcept {
    if (left() < count) return false;
    bytes = bytes_.subspan(count_, count);
    count_ += count;
    return true;
  }
  /// Advances to a multiple of `unit`; false unless the skipped bytes are zeros.
  [[nodiscard]] bool skip_padding(std::size_t unit) noexcept {
    for (const std::size_t end = round_up(count_, unit); count_ < end; ++count_)
      if (count_ >= bytes_.size() || bytes_[count_] != std::byte{0}) return false;
    return true;
  }
  std::size_t left() const noexcept { return bytes_.size() - count_; }
  std::size_t count() const noexcept { return count_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t count_ = 0;
};

/// The correct checksum of a header: that of the bytes before its member `checksum`.
template <class Header>
std::uint64_t header_checksum(const Header& header, std::uint64_t database_id) noexcept {
  return checksum(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, checksum)), database_id);
}

}  // namespace rtstdb::log
