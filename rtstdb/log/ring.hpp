#pragma once
// A lock-free queue of records from the committing thread to the writer thread: a byte ring of fixed size. A
// record is contiguous; if it does not fit before the end of the ring, the bytes up to the end are left
// unused.
//
// Threads: one producer, one consumer; any thread reads statistics. Neither waits for the other. All memory
// is allocated and touched in the constructor.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rtstdb/log/page_buffer.hpp"

namespace rtstdb::log {

class Ring {
 public:
  /// The size is rounded up to a multiple of 8.
  explicit Ring(std::size_t bytes);
  Ring(const Ring&) = delete;
  Ring& operator=(const Ring&) = delete;

  std::size_t capacity() const noexcept { return bytes_.size(); }
  /// The longest record that an empty ring can hold at any position.
  std::size_t longest_record() const noexcept { return bytes_.size() / 2; }

  // ---- producer

  /// Whether reserve(bytes) and a following reserve(more) would succeed.
  bool has_space_for(std::size_t bytes, std::size_t more = 0) const noexcept;
  /// Reserves room for a record, whose size must be a multiple of 8; empty: no room. commit makes the record
  /// visible.
  std::span<std::byte> reserve(std::size_t bytes) noexcept;
  void commit() noexcept;

  // ---- consumer

  /// Contiguous complete records, oldest first; not all of them if they wrap around. They stay until release.
  /// This does not read the records, which are in the producer's cache.
  std::span<const std::byte> view() noexcept;
  /// Releases the first `bytes` of the view, which must be complete records.
  void release(std::size_t bytes) noexcept;

  // ---- any thread

  std::size_t used() const noexcept;
  /// The largest number of bytes ever in use, including unused ends.
  std::size_t high_water() const noexcept { return high_water_.load(std::memory_order_relaxed); }

 private:
  std::size_t place_of(std::uint64_t position) const noexcept {
    return static_cast<std::size_t>(position % bytes_.size());
  }
  /// Bytes that a record at a place needs, including an unused end before it.
  std::size_t needed(std::size_t place, std::size_t bytes) const noexcept {
    const std::size_t to_end = bytes_.size() - place;
    return bytes <= to_end ? bytes : to_end + bytes;
  }
  /// The place after that record.
  std::size_t place_behind(std::size_t place, std::size_t bytes) const noexcept {
    const std::size_t end = (bytes <= bytes_.size() - place ? place : 0) + bytes;
    return end == bytes_.size() ? 0 : end;
  }

  // Positions only increase. Each thread writes to its own cache lines.
  alignas(64) std::atomic<std::uint64_t> head_{0};
  std::size_t head_place_ = 0;                      // cached, since the division is expensive
  std::uint64_t reserved_from_ = 0, reserved_ = 0;  // begin of the reserved record; head after commit
  /// The head at which the end of the ring was last left unused. The consumer passes it before the producer
  /// can do so again.
  std::atomic<std::uint64_t> left_out_from_{0};
  std::atomic<std::size_t> high_water_{0};
  std::span<std::byte> bytes_;  // of pages_
  alignas(64) std::atomic<std::uint64_t> tail_{0};
  PageBuffer pages_;
};

}  // namespace rtstdb::log
