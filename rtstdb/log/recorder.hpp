#pragma once
// The side of the log that the committing thread has: puts records into the ring, and keeps count of what did not fit. It
// neither allocates nor waits nor knows of a file.
//
// Small records may be collected, in memory that stays in this thread's cache, and handed over together: the ring's has been read by
// another processor, and to write there is waited for.
//
// Versions that found no room make a gap. It is told in the log, before the next record, when half of the ring is free again.
//
// Threads: one; `gap_versions` is anybody's.

#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

#include "rtstdb/log/record.hpp"
#include "rtstdb/log/ring.hpp"

namespace rtstdb::log {

class Recorder {
 public:
  explicit Recorder(Ring& ring);

  /// Whether the set, which need not be staged yet, would be recorded now, and could be taken back.
  bool room_for(const store::WriteSet& set) const noexcept;
  bool room_for(const LoggedGeometry& geometry) const noexcept;
  /// The set has been staged. False: no room, its version is in a gap.
  bool record(const store::WriteSet& set) noexcept;
  /// The same, but the record waits for hand_over, or for any other that is recorded. False: nothing was done; it is too large to be
  /// collected, or there is no room.
  [[nodiscard]] bool collect(const store::WriteSet& set) noexcept;
  /// Whether anything was collected; it is in the ring now.
  bool hand_over() noexcept;
  /// Of the version that was recorded last, or is in a gap.
  void take_back(Version version) noexcept;
  /// False: no room now. Its file is on disk already.
  [[nodiscard]] bool record(const LoggedGeometry& geometry) noexcept;

  /// Tells of a gap that is over: to be called now and then while nothing is committed, and before the end.
  void tend() noexcept;
  bool in_gap() const noexcept { return gap_from_ != 0; }
  /// Records that were put into the ring, or collected.
  std::uint64_t records() const noexcept { return records_; }

  /// Any thread: versions that were not recorded so far.
  std::uint64_t gap_versions() const noexcept { return gap_versions_.load(std::memory_order_relaxed); }

 private:
  /// Whether there is no gap, or no more.
  bool end_gap() noexcept;
  void commit() noexcept;

  Ring& ring_;
  std::vector<std::byte> collected_;
  std::size_t collected_bytes_ = 0;
  std::optional<WorldTime>
      time_before_;  // of the commit recorded last, unless it was taken back or a gap follows
  Version gap_from_ = 0, gap_to_ = 0;
  std::uint64_t records_ = 0;
  std::atomic<std::uint64_t> gap_versions_{0};
};

}  // namespace rtstdb::log
