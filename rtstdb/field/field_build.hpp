#pragma once
// The build of a first-order distance field without the computation of distances: it lists points, takes the
// distances of the geometry at these points, and lists further ones, until the field has the wanted error.
// The distances may be computed in parts, with other work in between.
//
//     auto build = FieldBuild::begin(box, is_closed(mesh), options);
//     while (const std::size_t count = build.value().next(points))
//       if (auto taken = build.value().take(their distances); !taken) return taken.error();
//     StoredField field = std::move(build).value().field();
//
// Passes of an attempt: the vertices of the coarse grid; the centres of its cells, which show where bricks
// are needed; the vertices of the bricks; random points in the bricks and in the whole grid, at which the
// field is compared with the exact distance. If the error is too large, another attempt with smaller cells
// follows. The random points have a fixed seed: the same mesh has the same field in each run.
//
// Threads: one. It allocates.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/field.hpp>
#include <rtstdb/geometry.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/field/stored_field.hpp"
#include "shaders/shared/field.h"

namespace rtstdb::field {

/// Errors: bad_input, with the value and its limits.
Result<void> check_field_options(const FieldOptions& options);

class FieldBuild {
 public:
  /// The options have passed check_field_options. Errors: capacity as take(); bad_input, if the sign is
  /// FieldSign::winding and the geometry is not closed.
  static Result<FieldBuild> begin(const Bounds& box, bool is_closed, const FieldOptions& options);

  /// Writes the points whose distances are needed next and returns their number. 0: the field is complete.
  std::size_t next(std::span<shared::FieldPoint> points);
  /// Whether the distances at the points of the last next() need a sign. If not, a sign is ignored.
  bool needs_sign() const noexcept;
  /// Takes the distances of all points of the last next(). Errors: capacity, if the field would need more
  /// than FieldOptions::max_bytes; bad_input, if cells would be too small for single precision.
  Result<void> take(std::span<const shared::FieldSample> samples);

  /// Never automatic.
  FieldSign sign() const noexcept { return sign_; }
  FieldProgress progress() const noexcept;
  /// After next() has returned 0. All of the report but its seconds is set.
  StoredField field() && { return std::move(field_); }

 private:
  FieldBuild(const Bounds& box, FieldSign sign, const FieldOptions& options);
  enum class Pass : std::uint8_t { coarse, centers, bricks, near_points, all_points, complete };

  Result<void> begin_attempt(double cell_m);
  Result<void> begin_pass(Pass pass);
  Result<void> end_pass();
  Result<void> end_attempt();
  Result<void> check_memory(std::uint64_t bricks) const;
  shared::FieldPoint point(std::uint32_t number) const noexcept;
  void take_one(std::uint32_t number, const shared::FieldSample& sample);
  double wanted_m() const noexcept { return options_.error_m > 0.0 ? options_.error_m : default_error_m_; }

  Bounds box_;
  FieldOptions options_;
  FieldSign sign_ = FieldSign::none;
  double default_error_m_ = 0.0;
  StoredField field_;
  double reached_m_ = 0.0;  ///< error_p99_m of the previous attempt
  Pass pass_ = Pass::coarse;
  std::uint32_t count_ = 0;  ///< points of the pass
  std::uint32_t named_ = 0;  ///< points that next() has returned
  std::uint32_t taken_ = 0;
  std::vector<std::uint32_t> cells_of_bricks_;
  std::vector<glm::vec3> random_points_m_;
  std::vector<double> errors_m_;
};

}  // namespace rtstdb::field
