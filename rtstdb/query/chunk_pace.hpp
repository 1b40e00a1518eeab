#pragma once
// Chunks are cut by what a batch takes on the whole, and costly elements may stand together in it: each chunk is as large as the last ones
// say that it should be. Part of what a chunk takes is the dispatch, however few are in it, so that smaller ones may be no shorter.

#include <algorithm>
#include <cstdint>

namespace rtstdb::query {

class ChunkPace {
 public:
  /// What a chunk was thought to take and took. `completed_before_wait`: it was done before anybody looked, and took less than that.
  struct Chunk {
    double predicted_ns = 0.0, took_ns = 0.0;
    bool completed_before_wait = false;
  };

  /// A chunk should take `chunk_ns`.
  explicit ChunkPace(std::int64_t chunk_ns) noexcept : chunk_ns_(static_cast<double>(chunk_ns)) {}

  /// Of the elements that are thought to take a chunk's time, so much is a chunk. More than all only where chunks turned out to be mostly
  /// dispatches: the batch would gain little, and whoever is urgent would wait.
  double share() const noexcept { return share_; }

  /// What comes now may cost more than was thought: so much at the most until a chunk of it is learnt from, and by that alone.
  void begin_with(double share) noexcept {
    if (share >= share_) return;
    share_ = share;
    before_ = {};
    by_elements_ = 0.0;
  }

  void learn(const Chunk& chunk) noexcept {
    // With the one before: where the host wakes late one chunk seems the longer for it, and the next the shorter.
    const double predicted_ns = chunk.predicted_ns + before_.predicted_ns;
    const double took_ns = chunk.took_ns + before_.took_ns;
    const double chunks = before_.predicted_ns > 0.0 ? 2.0 : 1.0;
    double share = took_ns < unremarkable * predicted_ns ? std::max(predicted_ns / took_ns, 1.0)
                                                         : predicted_ns / took_ns;
    share = std::clamp(share, min_share, most_);
    before_ = chunk;
    if (chunk.completed_before_wait) {
      if (share >= share_) {
        share_ = share;
      } else if (share < share_ / 2.0) {
        // The host was elsewhere, for how long nobody knows. Until chunks last as long they are not what others wait for.
        share_ = std::min(2.0 * share_, most_);
        before_ = {};
      }
      return;
    }
    tell_dispatch_from_elements(chunk);
    if (by_elements_ < min_by_elements && took_ns < chunks * std::max(1.5 * chunk_ns_, longest_dispatch_ns)) {
      const double doubled = 2.0 * predicted_ns / (chunks * chunk_ns_);
      share = std::max(share, std::min(doubled, weight_ >= few ? max_share : most_));
      most_ = std::max(most_, share);
    }
    share_ = share;
  }

 private:
  /// A line through the last chunks of different sizes: how much of what they took goes with the size.
  void tell_dispatch_from_elements(const Chunk& chunk) noexcept {
    const double thought = chunk.predicted_ns / chunk_ns_, took = chunk.took_ns / chunk_ns_;
    weight_ = weight_ * fading + 1.0;
    thought_ = thought_ * fading + thought;
    took_ = took_ * fading + took;
    thought_squared_ = thought_squared_ * fading + thought * thought;
    both_ = both_ * fading + thought * took;
    const double mean = thought_ / weight_;
    const double variance = thought_squared_ / weight_ - mean * mean;
    if (variance < min_variance * mean * mean || took_ <= 0.0) return;
    const double slope = (both_ / weight_ - mean * took_ / weight_) / variance;
    by_elements_ = std::clamp(slope * thought_ / took_, 0.0, 1.0);
  }

  static constexpr double unremarkable = 1.5;
  static constexpr double min_share = 1.0 / 4096.0, max_share = 64.0;
  static constexpr double fading = 0.85, min_variance = 0.04, few = 3.0;
  static constexpr double min_by_elements = 0.5;
  /// A dispatch takes no longer by itself, also on a busy machine: who waits for more waits for elements.
  static constexpr double longest_dispatch_ns = 800e3;
  double chunk_ns_, share_ = 1.0, most_ = 1.0;
  Chunk before_;
  double by_elements_ = 1.0;  // so much of what chunks take, as far as is known
  double weight_ = 0.0, thought_ = 0.0, took_ = 0.0, thought_squared_ = 0.0, both_ = 0.0;
};

}  // namespace rtstdb::query
