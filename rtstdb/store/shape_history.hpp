#pragma once
// The most recent shapes of each deforming geometry, each with the version that made it: what queries at
// older versions need. A ring of fixed size for each geometry.
//
// Threads: one. make and adopt are setup; nothing else allocates.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rtstdb/store/row_source.hpp"

namespace rtstdb::store {

class ShapeHistory {
 public:
  /// The shapes of one geometry.
  struct Ring {
    std::size_t position_count = 0;
    std::vector<glm::vec3> positions_m;  ///< slot by slot
    std::vector<Version> versions;       ///< by slot: the version that made the shape
    std::size_t newest = 0, count = 0;
  };
  /// A ring with one shape: the one that the geometry is added with (made_by = 0: it holds from the empty
  /// world on), or one that version `made_by` made. `retained_shapes` >= 1. Any thread.
  static std::unique_ptr<Ring> make(std::span<const glm::vec3> positions_m, std::uint32_t retained_shapes,
                                    Version made_by = 0);

  explicit ShapeHistory(std::uint32_t max_geometries) : kept_(max_geometries) {}
  /// Once for each geometry.
  void adopt(GeometryId geometry, std::unique_ptr<Ring> kept) noexcept;

  bool deforms(GeometryId geometry) const noexcept {
    return geometry.index < kept_.size() && kept_[geometry.index] != nullptr;
  }
  /// `geometry` deforms.
  std::size_t position_count(GeometryId geometry) const noexcept {
    return kept_[geometry.index]->position_count;
  }
  /// The shape in a version that is not older than oldest_kept().
  Shape at(GeometryId geometry, Version version) const noexcept;
  /// The oldest version all of whose shapes are kept.
  Version oldest_kept() const noexcept { return oldest_kept_; }
  /// Whether the shape of a version that is kept now will still be kept after one more record for this
  /// geometry.
  bool keeps_after_one_more(Version version, GeometryId geometry) const noexcept;
  /// Records the shape that the version gives the geometry. A second call for the same version replaces the
  /// first. Versions must not decrease.
  void record(Version version, GeometryId geometry, std::span<const glm::vec3> positions_m) noexcept;

 private:
  std::vector<std::unique_ptr<Ring>> kept_;  // by geometry; null: it does not deform
  Version oldest_kept_ = 0;
};

}  // namespace rtstdb::store
