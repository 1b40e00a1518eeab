#pragma once
// The last shapes of every geometry that deforms, each with the version that made it: what older versions are
// asked with. A ring of fixed size for each geometry.
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
  struct Kept {
    std::size_t position_count = 0;
    std::vector<glm::vec3> positions_m;  ///< of each shape in turn
    std::vector<Version> versions;       ///< that made them
    std::size_t newest = 0, count = 0;
  };
  /// With its first shape: the one that it is added with, which holds from the empty world on, or one that a version made.
  /// `kept_shapes` >= 1. Any thread.
  static std::unique_ptr<Kept> make(std::span<const glm::vec3> positions_m, std::uint32_t kept_shapes,
                                    Version made_by = 0);

  explicit ShapeHistory(std::uint32_t max_geometries) : kept_(max_geometries) {}
  /// Once a geometry.
  void adopt(GeometryId geometry, std::unique_ptr<Kept> kept) noexcept;

  bool deforms(GeometryId geometry) const noexcept {
    return geometry.index < kept_.size() && kept_[geometry.index] != nullptr;
  }
  // Of a geometry that deforms.
  std::size_t position_count(GeometryId geometry) const noexcept {
    return kept_[geometry.index]->position_count;
  }
  /// The shape in a version that is not before oldest_kept.
  Shape at(GeometryId geometry, Version version) const noexcept;
  /// The oldest version all of whose shapes are kept.
  Version oldest_kept() const noexcept { return oldest_kept_; }
  /// Whether a version whose shape is kept now will have it after one more.
  bool keeps_after_one_more(Version version, GeometryId geometry) const noexcept;
  /// The version gives the geometry this shape; the last one of a version counts. Versions never go back.
  void record(Version version, GeometryId geometry, std::span<const glm::vec3> positions_m) noexcept;

 private:
  std::vector<std::unique_ptr<Kept>> kept_;  // by geometry; null where it stays as it is
  Version oldest_kept_ = 0;
};

}  // namespace rtstdb::store
