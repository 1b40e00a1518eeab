#pragma once
// Copies the shape of a geometry in one version for a caller outside the engine.
//
// Threads: step by the engine's, all else by the owner's.

#include <optional>
#include <vector>

#include <rtstdb/database.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/transaction/engine_job.hpp"

namespace rtstdb::transaction {

class ShapeJob final : public EngineJob {
 public:
  /// `positions`: the number that the geometry has, to be reserved, since a step must not allocate.
  ShapeJob(GeometryId geometry, std::size_t positions, const ReadAt& read_at)
      : geometry_(geometry), read_at_(read_at) {
    positions_m_.reserve(positions);
  }

  bool step(const store::Store& store) noexcept override;
  /// The positions, or why the version can not be read. After the last step.
  Result<std::vector<glm::vec3>> take() &&;

 private:
  GeometryId geometry_;
  ReadAt read_at_;
  std::vector<glm::vec3> positions_m_;
  std::optional<BadInput> fault_;
};

}  // namespace rtstdb::transaction
