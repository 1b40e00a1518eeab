#pragma once
// The size of the next chunk, from what the last ones took: halved while they take too long, doubled while they are short.
// Part of a chunk's time is its dispatch, whatever its size: where a chunk of another size takes about as long, smaller
// chunks would be no shorter, and the size is doubled.
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

  /// The size of the next chunk: this many times the elements that are predicted to take a chunk's time. Above 1 only where
  /// chunks turned out to be mostly dispatch.
  double share() const noexcept { return share_; }

  /// The next elements may cost more than predicted: the size is at most `share` until a chunk of them was learned.
  void begin_with(double share) noexcept {
    if (share >= share_) return;
    share_ = share;
    previous_ = {};
    current_ = other_ = {};
    is_mostly_dispatch_ =
        true;  // so that a second size is tried, unless the first is too long for a dispatch
  }

  void learn(const Chunk& chunk) noexcept {
    const Measured last{chunk.predicted_ns / chunk_ns_, chunk.took_ns / chunk_ns_};
    // Two chunks together: where the host wakes late, one seems longer and the next one shorter.
    const bool is_first = previous_.size == 0.0;
    const Measured both =
        is_first ? last : Measured{(last.size + previous_.size) / 2.0, (last.took + previous_.took) / 2.0};
    const bool one_size = !is_first && !is_other_size(last, previous_);
    previous_ = last;
    if (chunk.completed_before_wait) {
      learn_upper_bound(both);
    } else {
      compare_sizes(one_size ? both : last);
      share_ = next_share(both);
      max_share_ = std::max(max_share_, share_);
    }
  }

 private:
  struct Measured {
    double size = 0.0;  ///< as share(); 0: nothing was measured
    double took = 0.0;  ///< in units of the chunk time
  };

  double next_share(const Measured& measured) const noexcept {
    double size = measured.size, took = measured.took;
    if (is_mostly_dispatch_ && took > min_took && took < max_dispatch_ns / chunk_ns_) {
      size *= 2.0;
    } else {
      for (; took > max_took; took /= 2.0)
        size /= 2.0;
      for (; took <= min_took && size < limit; took *= 2.0)
        size *= 2.0;
    }
    const bool may_exceed = is_mostly_dispatch_ && other_.size > 0.0;
    const double largest = may_exceed ? std::clamp(2.0 * measured.size, max_share_, limit) : max_share_;
    return std::clamp(size, 1.0 / 4096.0, largest);
  }

  void learn_upper_bound(const Measured& measured) noexcept {
    const double share = next_share(measured);
    if (share >= share_) {
      share_ = share;
    } else if (share < share_ / 2.0) {
      // The host was busy for an unknown time: the chunks are not known to be long.
      share_ = std::min(2.0 * share_, max_share_);
      previous_ = {};
    }
  }

  /// Finds how much the size matters, by comparison with the last chunks of another size.
  void compare_sizes(const Measured& measured) noexcept {
    if (is_other_size(measured, current_)) other_ = current_;
    current_ = measured;
    if (other_.size == 0.0) return;
    const auto& [small, large] =
        std::minmax(current_, other_, [](const Measured& a, const Measured& b) { return a.size < b.size; });
    if (large.took < min_took * small.took) {
      // The elements have become cheaper: that says nothing about the dispatch.
      other_ = {};
      is_mostly_dispatch_ = false;
    } else {
      is_mostly_dispatch_ = large.took / small.took - 1.0 < 0.5 * (large.size / small.size - 1.0);
    }
  }
  static bool is_other_size(const Measured& a, const Measured& b) noexcept {
    return b.size > 0.0 && (a.size >= 1.5 * b.size || b.size >= 1.5 * a.size);
  }

  static constexpr double min_took = 0.75, max_took = 2.0 * min_took;
  static constexpr double limit = 64.0;  ///< of share()
  /// A dispatch alone takes less than this also on a busy machine.
  static constexpr double max_dispatch_ns = 800e3;

  double chunk_ns_;
  double share_ = 1.0, max_share_ = 1.0;
  Measured previous_;         ///< the last chunk
  Measured current_, other_;  ///< the last chunks of one size, and those of another size before them
  bool is_mostly_dispatch_ = false;
};

}  // namespace rtstdb::query
