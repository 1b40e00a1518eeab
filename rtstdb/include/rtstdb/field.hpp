#pragma once
// First-order distance fields of geometries (paper, Section 4.2; Ban and Valasek 2020). A field gives the
// distance from a point to the nearest triangle of a geometry, approximately and at a cost that does not
// depend on the number of triangles. Cone queries in ConeMode::fast use it.
//
// A field lies on a coarse grid over the box of the geometry. Cells of the coarse grid that may hold a part
// of the surface have a brick of field_cells_per_brick^3 finer cells. Each vertex of both holds a distance
// and a gradient, in 8 bytes. Entity frame, metres.
//
// Threads: structs only.

#include <cstdint>
#include <functional>

namespace rtstdb {

/// How the inside of a geometry is found, where distances are negative.
enum class FieldSign : std::uint8_t {
  automatic,  ///< winding for a closed geometry (NearestQueryOptions), else none
  winding,    ///< inside where the surface winds around the point; refused for a geometry that is not closed
  /// Inside where at least field_inside_ratio of field_sign_rays rays, evenly spread over all directions, hit
  /// a triangle from behind (Wright 2015, with the paper's threshold). A ray that hits nothing counts as
  /// outside, so an open geometry has an inside where it nearly encloses a point.
  ray_ratio,
  none,  ///< all distances are positive
};

/// How far a build of a field is.
struct FieldProgress {
  std::uint64_t distances = 0;  ///< to the surface, computed so far
  std::uint64_t expected = 0;   ///< of this attempt in total; grows when another, finer attempt begins
};

struct FieldOptions {
  /// GeometryOptions::field: build the field when the first cone query in ConeMode::fast is prepared, instead
  /// of with the geometry.
  bool on_first_use = false;
  /// The error that 99 of 100 points near the surface (in the bricks) do not exceed. A field is built with
  /// finer and finer cells until it is reached. 0: 1/500 of the diagonal of the geometry's box.
  double error_m = 0.0;
  /// The edge of the cells in bricks; not 0: the field is built once with such cells, and error_m is 0.
  double cell_m = 0.0;
  FieldSign sign = FieldSign::automatic;
  /// Of the field on the device; the host holds the same again. A field that needs more is refused. At most
  /// max_field_bytes.
  std::uint64_t max_bytes = std::uint64_t{256} << 20;
  /// Called on the thread that waits for the build, after each part of it; empty: nobody is. With
  /// on_first_use that is the thread that prepares the query: what it refers to has to live until then.
  std::function<void(const FieldProgress&)> progress{};
};

/// A field that was built.
struct FieldReport {
  FieldSign sign = FieldSign::none;  ///< never automatic
  double cell_m = 0.0;               ///< edge of a cell in a brick
  std::uint64_t coarse_cells = 0;
  std::uint64_t bricks = 0;
  std::uint64_t bytes = 0;      ///< on the device
  std::uint64_t distances = 0;  ///< computed, in all attempts
  std::uint32_t attempts = 0;
  double seconds = 0.0;
  /// Differences between the field and the distance itself at random points in the bricks, without signs.
  double error_p50_m = 0.0;
  double error_p99_m = 0.0;
  double error_max_m = 0.0;
  /// The largest one at random points of the whole domain.
  double coarse_error_max_m = 0.0;
};

const char* to_string(FieldSign sign) noexcept;

}  // namespace rtstdb
