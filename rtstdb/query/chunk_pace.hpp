#pragma once
// Chunks are cut by what a batch takes on the whole, and costly elements may stand together in it: each chunk is as large as the last ones
// say that it should be.

#include <algorithm>
#include <cstdint>

namespace rtstdb::query {

class ChunkPace {
 public:
  /// What a chunk was thought to take and took. `seen_late`: it was done before anybody looked, and took less than that.
  struct Chunk {
    double thought_ns = 0.0, took_ns = 0.0;
    bool seen_late = false;
  };

  /// A chunk should take `chunk_ns`. Those that take less than `least_ns` are mostly what a dispatch takes by itself.
  explicit ChunkPace(std::int64_t chunk_ns) noexcept
      : room_(chunk_ns > 0 ? std::max(least_ns / static_cast<double>(chunk_ns), 1.0) : 1.0) {}

  /// Of the elements that are thought to take a chunk's time, so much is a chunk. Never more than all: the batch would gain little, and
  /// whoever is urgent would wait.
  double share() const noexcept { return share_; }

  void learn(const Chunk& chunk) noexcept {
    // With the one before: where the host wakes late one chunk seems the longer for it, and the next the shorter.
    const double thought_ns = chunk.thought_ns + before_.thought_ns;
    const double took_ns = chunk.took_ns + before_.took_ns;
    const double share = took_ns < unremarkable * room_ * thought_ns
                             ? 1.0
                             : std::clamp(room_ * thought_ns / took_ns, least_share, 1.0);
    before_ = chunk;
    if (!chunk.seen_late || share >= share_) {
      share_ = share;
    } else if (share < share_ / 2.0) {
      // The host was elsewhere, for how long nobody knows. Until chunks last as long they are not what others wait for.
      share_ = std::min(2.0 * share_, 1.0);
      before_ = {};
    }
  }

 private:
  static constexpr double unremarkable = 1.5;
  static constexpr double least_share = 1.0 / 4096.0;
  static constexpr double least_ns = 200e3;
  double room_ = 1.0, share_ = 1.0;
  Chunk before_;
};

}  // namespace rtstdb::query
