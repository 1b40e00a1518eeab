#pragma once
// Records on their way from the thread that commits to the one that writes: a ring of bytes with a fixed size. A record lies in
// one piece; where it does not fit before the end, the end is left out.
//
// Threads: one puts, one takes; statistics are anybody's. Neither waits for the other. All memory is taken and touched when
// the ring is made.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rtstdb/log/whole_pages.hpp"

namespace rtstdb::log {

class Ring {
 public:
  /// Bytes are rounded up to a multiple of 8.
  explicit Ring(std::size_t bytes);
  Ring(const Ring&) = delete;
  Ring& operator=(const Ring&) = delete;

  std::size_t capacity() const noexcept { return bytes_.size(); }
  /// The longest record that an empty ring takes wherever it stands.
  std::size_t longest_record() const noexcept { return bytes_.size() / 2; }

  // ---- the thread that puts

  /// Whether reserve(bytes) would give room, and reserve(more) behind it.
  bool room_for(std::size_t bytes, std::size_t more = 0) const noexcept;
  /// Room for a record whose size is a multiple of 8; empty where there is none. The record is seen when it is committed.
  std::span<std::byte> reserve(std::size_t bytes) noexcept;
  void commit() noexcept;

  // ---- the thread that takes

  /// Whole records, oldest first, in one piece: not all of them where they go around the end. They stay until release. None of them is
  /// looked at: they are in the other thread's cache.
  std::span<const std::byte> view() noexcept;
  /// The first `bytes` of what view gave: whole records.
  void release(std::size_t bytes) noexcept;

  // ---- any thread

  std::size_t used() const noexcept;
  /// The most that was ever used, with ends that were left out.
  std::size_t high_water() const noexcept { return high_water_.load(std::memory_order_relaxed); }

 private:
  std::size_t place_of(std::uint64_t position) const noexcept {
    return static_cast<std::size_t>(position % bytes_.size());
  }
  /// Bytes that a record at a place takes, with the end that is left out before it.
  std::size_t needed(std::size_t place, std::size_t bytes) const noexcept {
    const std::size_t to_end = bytes_.size() - place;
    return bytes <= to_end ? bytes : to_end + bytes;
  }
  /// Where the next one stands.
  std::size_t place_behind(std::size_t place, std::size_t bytes) const noexcept {
    const std::size_t end = (bytes <= bytes_.size() - place ? place : 0) + bytes;
    return end == bytes_.size() ? 0 : end;
  }

  // Positions only grow. What each thread changes lies in cache lines of its own.
  alignas(64) std::atomic<std::uint64_t> head_{0};
  std::size_t head_place_ = 0;                      // kept, since a division takes as long as all else
  std::uint64_t reserved_from_ = 0, reserved_ = 0;  // where the reserved record begins; the head after commit
  /// The head from which the end was left out last. The next time is not before those behind it were taken.
  std::atomic<std::uint64_t> left_out_from_{0};
  std::atomic<std::size_t> high_water_{0};
  std::span<std::byte> bytes_;  // of the pages
  alignas(64) std::atomic<std::uint64_t> tail_{0};
  WholePages pages_;
};

}  // namespace rtstdb::log
