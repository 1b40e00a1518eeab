#pragma once
// The part of the log on the committing thread: puts records into the ring and counts the versions that did
// not fit. It neither allocates nor blocks nor accesses files.
//
// Small records can be collected in memory that stays in this thread's cache, and put into the ring together:
// each write to the ring waits for a cache line that the writer thread has read on another processor.
//
// Versions that did not fit form a gap. A gap record is put into the ring before the next record, as soon as
// half of the ring is free.
//
// Threads: one; any thread may call gap_versions.

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

  /// Whether there is room for the set, which need not be staged, and for a record that discards it.
  bool has_space_for(const store::WriteSet& set) const noexcept;
  bool has_space_for(const LoggedGeometry& geometry) const noexcept;
  bool has_space_for(const LoggedMaterial& material) const noexcept;
  bool has_space_for(const LoggedLight& light) const noexcept;
  /// Records a staged set. False: no room; its version becomes part of a gap.
  bool record(const store::WriteSet& set) noexcept;
  /// Records a staged set in the collecting memory; flush, or the next record, puts it into the ring.
  /// False: no room, or too large to be collected; nothing is done.
  [[nodiscard]] bool collect(const store::WriteSet& set) noexcept;
  /// Puts collected records into the ring. Returns whether there were any.
  bool flush() noexcept;
  /// Records that a version was discarded. It must be the last one recorded, or in a gap.
  void discard(Version version) noexcept;
  /// Records a geometry whose file is on disk. False: no room.
  [[nodiscard]] bool record(const LoggedGeometry& geometry) noexcept;
  [[nodiscard]] bool record(const LoggedMaterial& material) noexcept;
  [[nodiscard]] bool record(const LoggedLight& light) noexcept;

  /// Puts collected records and a pending gap record into the ring, if there is room. To be called from time
  /// to time while nothing is committed, and before the end.
  void maintain() noexcept;
  bool in_gap() const noexcept { return gap_from_ != 0; }
  /// Number of records put into the ring or collected.
  std::uint64_t records() const noexcept { return records_; }

  /// Any thread: number of versions that were not recorded.
  std::uint64_t gap_versions() const noexcept { return gap_versions_.load(std::memory_order_relaxed); }

 private:
  /// Records the end of a gap if there is one and room for it. Returns whether no gap is open.
  bool end_gap() noexcept;
  bool has_space_for_bytes(std::size_t bytes) const noexcept;
  /// Records a geometry, a material or a light. False: no room.
  template <class Encode>
  bool record_bytes(std::size_t bytes, const Encode& encode) noexcept;
  void commit() noexcept;

  Ring& ring_;
  std::vector<std::byte> collected_;
  std::size_t collected_bytes_ = 0;
  // World time of the last recorded commit; none after a discarded version or a gap.
  std::optional<WorldTime> previous_time_;
  Version gap_from_ = 0, gap_to_ = 0;
  std::uint64_t records_ = 0;
  std::atomic<std::uint64_t> gap_versions_{0};
};

}  // namespace rtstdb::log
