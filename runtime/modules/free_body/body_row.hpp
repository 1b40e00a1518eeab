#pragma once
// The row of a body that is in the database: whether it still describes the motion well enough, and the row
// that replaces it.
//
// A row describes a motion with constant velocities. It is kept as long as it differs from the motion by at
// most the permitted errors, both at the begin and at the end of a step. The row that replaces it has the
// mean velocities of the step, so that it is exact at the begin of the step, and its error at the end is of
// third order in the step's length.
//
// Threads: one.

#include <optional>

#include <rtstdb/entity.hpp>

#include "runtime/modules/free_body/rigid_body.hpp"

namespace hil::modules {

/// A body's motion in one step: its state at the begin and at the end of it.
struct BodyStep {
  RigidBodyState begin, end;
  rtstdb::WorldTime begin_time{}, end_time{};
};

struct RowError {
  double position_m = 0.0;
  double angle_rad = 0.0;
};

/// How far a row is from the state at an instant.
RowError error_of(const rtstdb::Motion& row, const RigidBodyState& state, rtstdb::WorldTime t) noexcept;

class BodyRow {
 public:
  /// The largest errors that a row may have. Both are positive.
  explicit BodyRow(const RowError& permitted) : permitted_(permitted) {}

  /// The row to write for this step; empty: the written one is good enough.
  std::optional<rtstdb::Motion> replacement(const RigidBody& body, const BodyStep& step) noexcept;
  /// The row is in the database.
  void set_written(const rtstdb::Motion& row) noexcept { written_ = row; }
  /// Called when it is not known which row the database has: the next step writes one.
  void forget() noexcept { written_.reset(); }

  /// Whether the errors of the written row at the end of the step are permitted.
  bool holds_at_end(const BodyStep& step) const noexcept;
  /// The largest errors that a written row had at the begin of a step.
  const RowError& largest_error() const noexcept { return largest_; }

 private:
  bool is_permitted(const RowError& error) const noexcept {
    return error.position_m <= permitted_.position_m && error.angle_rad <= permitted_.angle_rad;
  }

  RowError permitted_;
  RowError largest_;
  std::optional<rtstdb::Motion> written_;
};

}  // namespace hil::modules
