#include "rtstdb/log/ring.hpp"

#include <cstring>

#include <rtstdb/result.hpp>

#include "rtstdb/log/format.hpp"

namespace rtstdb::log {

Ring::Ring(std::size_t bytes) : bytes_(round_up(bytes, 8)) {
  RTSTDB_ASSERT(bytes >= 64);
}

std::size_t Ring::needed(std::uint64_t position, std::size_t bytes) const noexcept {
  const std::size_t to_end = bytes_.size() - place_of(position);
  return bytes <= to_end ? bytes : to_end + bytes;
}

bool Ring::room_for(std::size_t bytes, std::size_t more) const noexcept {
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  std::size_t all = needed(head, bytes);
  if (more != 0) all += needed(head + all, more);
  return bytes <= bytes_.size() && head + all - tail_.load(std::memory_order_acquire) <= bytes_.size();
}

std::span<std::byte> Ring::reserve(std::size_t bytes) noexcept {
  RTSTDB_ASSERT(bytes >= sizeof(RecordHeader) && bytes % 8 == 0);
  if (!room_for(bytes)) return {};
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  const std::size_t all = needed(head, bytes);
  if (all != bytes) {
    // The size is not told: the end of the ring is where padding ends.
    const RecordHeader padding{RecordKind::padding, 0};
    std::memcpy(bytes_.data() + place_of(head), &padding, sizeof padding);
  }
  reserved_ = head + all;
  return std::span(bytes_).subspan(place_of(head + all - bytes), bytes);
}

void Ring::commit() noexcept {
  RTSTDB_ASSERT(reserved_ > head_.load(std::memory_order_relaxed));
  head_.store(reserved_, std::memory_order_release);
  const auto in_use = static_cast<std::size_t>(reserved_ - tail_.load(std::memory_order_relaxed));
  if (in_use > high_water_.load(std::memory_order_relaxed))
    high_water_.store(in_use, std::memory_order_relaxed);
}

std::span<const std::byte> Ring::view() noexcept {
  const std::uint64_t head = head_.load(std::memory_order_acquire);
  std::uint64_t tail = tail_.load(std::memory_order_relaxed);
  std::size_t length = 0;
  while (tail + length != head) {
    const std::size_t place = place_of(tail) + length;
    if (place == bytes_.size()) break;
    RecordHeader header;
    std::memcpy(&header, bytes_.data() + place, sizeof header);
    if (header.kind != RecordKind::padding) {
      length += header.bytes;
      continue;
    }
    if (length != 0) break;
    tail += bytes_.size() - place;
    tail_.store(tail, std::memory_order_release);
  }
  return std::span(bytes_).subspan(place_of(tail), length);
}

void Ring::release(std::size_t bytes) noexcept {
  tail_.store(tail_.load(std::memory_order_relaxed) + bytes, std::memory_order_release);
}

std::size_t Ring::used() const noexcept {
  const std::uint64_t tail = tail_.load(std::memory_order_acquire);
  return static_cast<std::size_t>(head_.load(std::memory_order_acquire) - tail);
}

}  // namespace rtstdb::log
