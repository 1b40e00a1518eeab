#pragma once
// Writes the rows of the bodies that move: of those near a contact in each step, of others when their row no
// longer describes the motion.
//
// Threads: creation while configuring; all else in the tick, without allocation.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <hil/world/world_module.hpp>

#include "runtime/modules/rigid_bodies/body_set.hpp"

namespace hil::modules {

class BodyWriter {
 public:
  /// The rows of the bodies are in the database as `bodies` has them. Reserves device time for the task.
  BodyWriter(World& world, const TaskParameters& task, std::vector<rtstdb::EntityId> entities,
             const BodySet& bodies, const RowError& permitted);

  /// Keeps the states at the begin of the coming step.
  void begin_step(const BodySet& bodies) noexcept;
  /// Writes rows for the step from begin_step's states to those of `bodies`. `is_near`: by body.
  void write_step(WorldStep& context, const BodySet& bodies, std::span<const char> is_near) noexcept;
  /// Writes rows with the states and velocities of the bodies at the step's time: after skipped releases the
  /// rows are those of an earlier step.
  void write_states(WorldStep& context, const BodySet& bodies) noexcept;

  const RigidBodyState& state_at_begin(std::size_t body) const noexcept { return begin_[body]; }

  std::uint64_t rows() const noexcept { return rows_; }
  /// The version of the last row.
  rtstdb::Version version() const noexcept { return version_; }

 private:
  /// The row to write, and the body.
  struct Pending {
    std::size_t body = 0;
    rtstdb::Motion row{};
  };
  void write_pending(WorldStep& context) noexcept;

  rtstdb::Database& database_;
  const std::vector<rtstdb::EntityId> entities_;
  const RowError permitted_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  rtstdb::Reservation* reservation_ = nullptr;          ///< of the world; null: refused
  std::vector<std::optional<rtstdb::Motion>> written_;  ///< by body; empty: not known
  std::vector<RigidBodyState> begin_;                   ///< by body
  std::vector<Pending> pending_;
  std::uint64_t rows_ = 0;
  rtstdb::Version version_ = 0;
};

}  // namespace hil::modules
