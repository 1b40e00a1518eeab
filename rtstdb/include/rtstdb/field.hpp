#pragma once
// First-order distance fields of geometries (paper, Section 4.2; Ban and Valasek 2020). A field gives the
// distance from a point to the nearest triangle of a geometry, approximately and at a cost that does not
// depend on the number of triangles. Cone queries in ConeMode::fast use it.
//
// A field consists of a coarse grid over the box of the geometry, and of a brick of field_cells_per_brick^3
// finer cells in each coarse cell on or near the surface. Each vertex of both holds a distance and its
// gradient, in 8 bytes. Entity frame, metres.
//
// Threads: structs only.

#include <cstdint>
#include <functional>

namespace rtstdb {

/// How it is decided whether a point is inside the geometry, where distances are negative.
enum class FieldSign : std::uint8_t {
  automatic,  ///< winding for a closed geometry (NearestQueryOptions), else none
  winding,    ///< inside where the winding number is not 0; refused for a geometry that is not closed
  /// Inside where at least field_inside_ratio of field_sign_rays rays, evenly spread over all directions,
  /// first hit a triangle from behind (Wright 2015, with the paper's threshold). A ray that hits nothing
  /// counts as outside, so a point is inside an open geometry only if that nearly encloses it.
  ray_ratio,
  none,  ///< all distances are positive
};

/// The progress of a build.
struct FieldProgress {
  std::uint64_t distances = 0;  ///< computed so far, in all attempts
  /// `distances` at the end of the current attempt; grows when another attempt with smaller cells begins.
  std::uint64_t expected = 0;
};

struct FieldOptions {
  /// GeometryOptions::field: build the field when the first cone query in ConeMode::fast is prepared, instead
  /// of with the geometry. Database::build_field ignores it.
  bool on_first_use = false;
  /// The error that 99 of 100 points near the surface (in the bricks) may have. Attempts with smaller and
  /// smaller cells are made until the field meets it. 0: 1/500 of the diagonal of the geometry's box.
  double error_m = 0.0;
  /// The edge of a cell in a brick, for one attempt, whatever its error; excludes error_m. 0: chosen by the
  /// error.
  double cell_m = 0.0;
  FieldSign sign = FieldSign::automatic;
  /// The largest size of the field on the device; at most max_field_bytes. A field that needs more is
  /// refused. The host keeps a copy of about the same size.
  std::uint64_t max_bytes = std::uint64_t{256} << 20;
  /// Called after each part of the build, on the thread that waits for it; empty: not called. With
  /// on_first_use that is the thread that prepares the query, so what the function refers to has to live
  /// until then. If it throws, the build ends without a field and with bad_input.
  std::function<void(const FieldProgress&)> progress{};
};

/// The size, cost and error of a field that was built.
struct FieldReport {
  FieldSign sign = FieldSign::none;  ///< never automatic
  double cell_m = 0.0;               ///< edge of a cell in a brick
  std::uint64_t coarse_cells = 0;
  std::uint64_t bricks = 0;
  std::uint64_t bytes = 0;      ///< on the device
  std::uint64_t distances = 0;  ///< computed, in all attempts
  std::uint32_t attempts = 0;
  double seconds = 0.0;
  /// Differences between the field and the exact distance, both without sign, at random points in the bricks.
  double error_p50_m = 0.0;
  double error_p99_m = 0.0;
  double error_max_m = 0.0;
  /// The largest difference at random points of the whole grid.
  double grid_error_max_m = 0.0;
};

const char* to_string(FieldSign sign) noexcept;

}  // namespace rtstdb
