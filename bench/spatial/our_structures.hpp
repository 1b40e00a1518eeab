#pragma once
// Top-level structures built by rtstdb/accel alone, without transactions and queries: the cost of a tick in
// which everything has moved.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <rtstdb/entity.hpp>
#include <rtstdb/geometry.hpp>

namespace hil::bench {

class OurTlas {
 public:
  /// One static instance of the mesh per place. Without `refits` every structure is built anew.
  OurTlas(const rtstdb::TriangleMesh& mesh, std::span<const rtstdb::Pose> places, bool refits);
  ~OurTlas();
  OurTlas(const OurTlas&) = delete;
  OurTlas& operator=(const OurTlas&) = delete;

  /// Moves every row without updating the structure.
  void place(std::span<const rtstdb::Pose> places);
  /// Updates the structure to the rows by patching or rebuilding, as rtstdb/accel decides. Returns the
  /// device's own time in seconds.
  double update();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// One mesh with moving vertices.
class OurDeforming {
 public:
  explicit OurDeforming(const rtstdb::TriangleMesh& mesh);
  ~OurDeforming();
  OurDeforming(const OurDeforming&) = delete;
  OurDeforming& operator=(const OurDeforming&) = delete;

  /// Updates the structure to these positions by refitting or rebuilding, as rtstdb/accel decides. Returns
  /// the device's own time in seconds.
  double update(std::span<const glm::vec3> positions_m);
  /// The number of rebuilt trees.
  std::uint64_t builds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Bytes of nodes and triangles on the device.
std::size_t our_mesh_bytes(const rtstdb::TriangleMesh& mesh);
/// Bytes that searches read on the device, for one version with this many entities.
std::size_t our_version_bytes(std::uint32_t entities);

}  // namespace hil::bench
