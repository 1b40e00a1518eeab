#pragma once
// Copies the rows of one version for a caller outside the engine, a slice at a time: the version is pinned,
// so that commits between the slices do not matter.

#include <cstdint>
#include <optional>
#include <vector>

#include <rtstdb/database.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/transaction/engine_job.hpp"

namespace rtstdb::transaction {

class SnapshotJob final : public EngineJob {
 public:
  /// `room`: as many rows as there can be; reserved here, since steps must not allocate.
  SnapshotJob(const ReadAt& read_at, std::size_t room) : read_at_(read_at) { states_.reserve(room); }

  bool step(const store::Store& store) noexcept override;
  /// After the last step.
  Result<std::vector<EntityState>> take() &&;

 private:
  static constexpr std::uint32_t indices_per_step = 256;
  static constexpr int attempts_in_slices = 3;

  ReadAt read_at_;
  std::optional<store::Snapshot> snapshot_;
  std::uint32_t next_index_ = 0;
  int attempts_ = 0;
  std::vector<EntityState> states_;
  std::optional<BadInput> fault_;
};

}  // namespace rtstdb::transaction
