#pragma once
// Starts the change feed and copies the version before the first commit that is queued: all rows, and the
// bounds of deforming geometry. Works in steps, between transactions. If too many commits follow during the
// copy, it starts again with a newer version.

#include <cstdint>
#include <optional>
#include <vector>

#include "rtstdb/standing/change_feed.hpp"
#include "rtstdb/standing/mirror.hpp"
#include "rtstdb/transaction/engine_job.hpp"

namespace rtstdb::standing {

class CopyVersionJob final : public transaction::EngineJob {
 public:
  /// `room`: the largest number of rows; reserved here, since steps must not allocate.
  CopyVersionJob(ChangeFeed& feed, std::size_t space);

  bool step(const store::Store& store) noexcept override;
  /// After the last step.
  VersionInfo version() const noexcept { return {snapshot_->version(), snapshot_->time()}; }
  const std::vector<EntityState>& rows() const noexcept { return rows_; }
  const std::vector<Mirror::ShapeBounds>& shapes() const noexcept { return shapes_; }

 private:
  static constexpr std::uint32_t indices_per_step = 256;
  static constexpr int max_sliced_attempts = 3;

  void begin(const store::Store& store) noexcept;

  ChangeFeed& feed_;
  std::optional<store::Snapshot> snapshot_;
  std::uint32_t next_index_ = 0;
  int attempts_ = 0;
  std::vector<EntityState> rows_;
  std::vector<Mirror::ShapeBounds> shapes_;
};

}  // namespace rtstdb::standing
