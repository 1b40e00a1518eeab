#pragma once
// The size of the next chunk, from what the last ones took: halved while they take too long, doubled while
// they are short. Part of a chunk's time is its dispatch, whatever its size: where a chunk of another size
// takes about as long, smaller chunks would be no shorter, and the size is doubled.
//
// Threads: one at a time.

#include <algorithm>
#include <cstdint>

namespace rtstdb::query {

class ChunkPace {
 public:
  struct Chunk {
    double predicted_ns = 0.0, took_ns = 0.0;
    /// The chunk was complete before the host looked: it took less than `took_ns`.
    bool completed_before_wait = false;
  };

  /// A chunk should take `chunk_ns`.
  explicit ChunkPace(std::int64_t chunk_ns) noexcept : chunk_ns_(static_cast<double>(chunk_ns)) {}

  /// The size of the next chunk, as a multiple of the number of elements that is predicted to take the
  /// planned time. Above 1 only where chunks turned out to be mostly dispatch.
  double relative_size() const noexcept { return relative_size_; }

  /// The next elements may cost more than predicted: the size is at most `relative_size` until a chunk of
  /// them was measured.
  void begin_with(double relative_size) noexcept {
    if (relative_size >= relative_size_) return;
    relative_size_ = relative_size;
    previous_ = {};
    current_ = other_size_ = {};
    // Nothing is known of the new size. Assumed to be mostly dispatch, a chunk that is not too long for that
    // is followed by one of twice the size, and comparing the two corrects the assumption.
    is_mostly_dispatch_ = true;
  }

  void update(const Chunk& chunk) noexcept {
    const Measured last{chunk.predicted_ns / chunk_ns_, chunk.took_ns / chunk_ns_};
    // Two chunks together: where the host wakes late, one seems longer and the next one shorter.
    const bool is_first = previous_.size == 0.0;
    const Measured both =
        is_first ? last : Measured{(last.size + previous_.size) / 2.0, (last.took + previous_.took) / 2.0};
    const bool one_size = !is_first && !is_other_size(last, previous_);
    previous_ = last;
    if (chunk.completed_before_wait) {
      update_from_upper_bound(both);
    } else {
      compare_sizes(one_size ? both : last);
      relative_size_ = next_size(both);
      max_relative_size_ = std::max(max_relative_size_, relative_size_);
    }
  }

 private:
  struct Measured {
    double size = 0.0;  ///< as relative_size(); 0: nothing was measured
    double took = 0.0;  ///< the measured time divided by the planned time (chunk_ns_)
  };

  double next_size(const Measured& measured) const noexcept {
    double size = measured.size, took = measured.took;
    if (is_mostly_dispatch_ && took > min_took && took < max_dispatch_ns / chunk_ns_) {
      size *= 2.0;
    } else {
      while (took > max_took) {
        took /= 2.0;
        size /= 2.0;
      }
      while (took <= min_took && size < limit) {
        took *= 2.0;
        size *= 2.0;
      }
    }
    const bool may_exceed = is_mostly_dispatch_ && other_size_.size > 0.0;
    const double largest =
        may_exceed ? std::clamp(2.0 * measured.size, max_relative_size_, limit) : max_relative_size_;
    return std::clamp(size, 1.0 / 4096.0, largest);
  }

  void update_from_upper_bound(const Measured& measured) noexcept {
    const double relative_size = next_size(measured);
    if (relative_size >= relative_size_) {
      relative_size_ = relative_size;
    } else if (relative_size < relative_size_ / 2.0) {
      // The host was busy for an unknown time: the chunks are not known to be long.
      relative_size_ = std::min(2.0 * relative_size_, max_relative_size_);
      previous_ = {};
    }
  }

  /// Finds how much the size matters, by comparison with the last chunks of another size.
  void compare_sizes(const Measured& measured) noexcept {
    if (is_other_size(measured, current_)) other_size_ = current_;
    current_ = measured;
    if (other_size_.size == 0.0) return;
    const auto& [small, large] = std::minmax(
        current_, other_size_, [](const Measured& a, const Measured& b) { return a.size < b.size; });
    if (large.took < min_took * small.took) {
      // The elements have become cheaper: that says nothing about the dispatch.
      other_size_ = {};
      is_mostly_dispatch_ = false;
    } else {
      is_mostly_dispatch_ = large.took / small.took - 1.0 < 0.5 * (large.size / small.size - 1.0);
    }
  }
  static bool is_other_size(const Measured& a, const Measured& b) noexcept {
    return b.size > 0.0 && (a.size >= 1.5 * b.size || b.size >= 1.5 * a.size);
  }

  static constexpr double min_took = 0.75, max_took = 2.0 * min_took;
  static constexpr double limit = 64.0;  ///< of relative_size()
  /// A dispatch alone takes less than this also on a busy machine.
  static constexpr double max_dispatch_ns = 800e3;

  double chunk_ns_;
  double relative_size_ = 1.0, max_relative_size_ = 1.0;
  Measured previous_;              ///< the last chunk
  Measured current_, other_size_;  ///< the last chunks of one size, and those of another size before them
  bool is_mostly_dispatch_ = false;
};

}  // namespace rtstdb::query
