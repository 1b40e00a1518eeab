#pragma once
// Where the answers of a query lie, by its LatePolicy.

#include <cstddef>
#include <cstdint>

#include <rtstdb/query.hpp>

namespace rtstdb::query {

/// Which answers the caller reads while others are written: elsewhere, where those of before have to stay.
class AnswerPlaces {
 public:
  AnswerPlaces() = default;
  explicit AnswerPlaces(LatePolicy late) : count_(late == LatePolicy::last_good ? 2 : 1) {}

  std::size_t count() const noexcept { return count_; }
  std::size_t read() const noexcept { return read_; }
  std::size_t written() const noexcept { return written_; }
  /// So many elements have answers to be read.
  std::uint32_t readable() const noexcept { return readable_; }

  /// What was written is what the caller reads.
  void publish_answers(std::uint32_t elements) noexcept {
    readable_ = elements;
    read_ = written_;
    written_ = (written_ + 1) % count_;
  }
  /// It is not; what stood before is, where that was to stay.
  void discard_answers() noexcept {
    if (count_ == 1) readable_ = 0;
  }

 private:
  std::size_t count_ = 1, read_ = 0, written_ = 0;
  std::uint32_t readable_ = 0;
};

}  // namespace rtstdb::query
