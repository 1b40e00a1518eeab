#pragma once
// Copies the rows of one version for a caller outside the engine, one slice per step. When commits push the
// version out of the history between two steps, the copy begins again; after some attempts it takes all rows
// in one step.
//
// Threads: step by the engine's, all else by the owner's.

#include <cstdint>
#include <optional>
#include <vector>

#include <rtstdb/database.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/transaction/engine_job.hpp"

namespace rtstdb::transaction {

class SnapshotJob final : public EngineJob {
 public:
  /// `max_entities`: capacity to be reserved, since steps must not allocate.
  SnapshotJob(const ReadAt& read_at, std::size_t max_entities) : read_at_(read_at) {
    states_.reserve(max_entities);
  }

  bool step(const store::Store& store) noexcept override;
  /// The rows by ascending index, or why the version can not be read. After the last step.
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
