#pragma once
// Chunks are cut by what a batch takes on the whole, and costly elements may stand together in it: each chunk is as large as the last ones
// say that it should be.

#include <algorithm>
#include <cstdint>

namespace rtstdb::query {

class ChunkPace {
 public:
  /// Of the elements that are thought to take a chunk's time, so much is a chunk.
  double share() const noexcept { return share_; }

  /// A chunk that was thought to take `thought_ns` took `took_ns`. One that was faster than thought changes nothing: the batch would gain
  /// little, and whoever is urgent would wait.
  void learn(double thought_ns, std::int64_t took_ns) noexcept {
    const Chunk chunk{thought_ns, static_cast<double>(took_ns)};
    // With the one before: of two that are under way one is seen late to be done, and the other seems the shorter for it.
    const double thought = chunk.thought_ns + before_.thought_ns;
    const double took = chunk.took_ns + before_.took_ns;
    before_ = chunk;
    share_ = took < unremarkable * thought ? 1.0 : std::clamp(thought / took, least_share, 1.0);
  }

 private:
  struct Chunk {
    double thought_ns = 0.0, took_ns = 0.0;
  };
  static constexpr double unremarkable = 1.5;
  static constexpr double least_share = 1.0 / 4096.0;
  double share_ = 1.0;
  Chunk before_;
};

}  // namespace rtstdb::query
