#include "rtstdb/log/ring.hpp"

#include <algorithm>

#include <rtstdb/result.hpp>

#include "rtstdb/log/format.hpp"

namespace rtstdb::log {

Ring::Ring(std::size_t bytes) : pages_(round_up(bytes, 8)) {
  RTSTDB_ASSERT(bytes >= 64, "the ring has less than 64 bytes");
  bytes_ = pages_.bytes();
}

bool Ring::has_space_for(std::size_t bytes, std::size_t more) const noexcept {
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  const std::size_t free =
      bytes_.size() - static_cast<std::size_t>(head - tail_.load(std::memory_order_acquire));
  std::size_t all = needed(head_place_, bytes);
  if (more != 0) all += needed(place_behind(head_place_, bytes), more);
  return all <= free;
}

std::span<std::byte> Ring::reserve(std::size_t bytes) noexcept {
  RTSTDB_ASSERT(bytes >= sizeof(RecordHeader) && bytes % 8 == 0,
                "the record is shorter than its header, or its size is not a multiple of 8");
  if (!has_space_for(bytes)) return {};
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  const std::size_t all = needed(head_place_, bytes);
  reserved_from_ = head + all - bytes;
  reserved_ = head + all;
  return bytes_.subspan(all == bytes ? head_place_ : 0, bytes);
}

void Ring::commit() noexcept {
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  RTSTDB_ASSERT(reserved_ > head, "no record was reserved");
  if (reserved_from_ != head) left_out_from_.store(head, std::memory_order_relaxed);
  head_place_ = place_behind(head_place_, static_cast<std::size_t>(reserved_ - reserved_from_));
  head_.store(reserved_, std::memory_order_release);
  const auto in_use = static_cast<std::size_t>(reserved_ - tail_.load(std::memory_order_relaxed));
  if (in_use > high_water_.load(std::memory_order_relaxed))
    high_water_.store(in_use, std::memory_order_relaxed);
}

std::span<const std::byte> Ring::view() noexcept {
  const std::uint64_t head = head_.load(std::memory_order_acquire);
  std::uint64_t tail = tail_.load(std::memory_order_relaxed);
  std::uint64_t lap_end = tail - place_of(tail) + bytes_.size();
  // It was stored before the head that is past it. An older value is before the tail.
  const std::uint64_t left_out_from = left_out_from_.load(std::memory_order_relaxed);
  if (head > lap_end && left_out_from == tail) {
    tail = lap_end;
    lap_end += bytes_.size();
    tail_.store(tail, std::memory_order_release);
  } else if (head > lap_end && left_out_from > tail) {
    lap_end = left_out_from;
  }
  return bytes_.subspan(place_of(tail), static_cast<std::size_t>(std::min(head, lap_end) - tail));
}

void Ring::release(std::size_t bytes) noexcept {
  tail_.store(tail_.load(std::memory_order_relaxed) + bytes, std::memory_order_release);
}

std::size_t Ring::used() const noexcept {
  const std::uint64_t tail = tail_.load(std::memory_order_acquire);
  return static_cast<std::size_t>(head_.load(std::memory_order_acquire) - tail);
}

}  // namespace rtstdb::log
