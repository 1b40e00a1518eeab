#pragma once
// Where a query keeps its answers: in one slot, or in two with LatePolicy::last_good.

#include <cstddef>
#include <cstdint>

#include <rtstdb/query.hpp>

namespace rtstdb::query {

/// The slot that the caller reads, and the slot that the next run writes. With LatePolicy::last_good these
/// differ, so that the last valid answers stay readable.
class AnswerSlots {
 public:
  explicit AnswerSlots(LatePolicy late) : count_(late == LatePolicy::last_good ? 2 : 1) {}

  std::size_t count() const noexcept { return count_; }
  std::size_t read() const noexcept { return read_; }
  std::size_t written() const noexcept { return written_; }
  /// Elements whose answers the caller may read.
  std::uint32_t readable() const noexcept { return readable_; }

  /// The caller reads the slot that was written, `elements` of it.
  void publish(std::uint32_t elements) noexcept {
    readable_ = elements;
    read_ = written_;
    written_ = (written_ + 1) % count_;
  }
  /// The caller does not read what was written. With one slot, nothing is readable.
  void discard() noexcept {
    if (count_ == 1) readable_ = 0;
  }

 private:
  std::size_t count_, read_ = 0, written_ = 0;
  std::uint32_t readable_ = 0;
};

}  // namespace rtstdb::query
