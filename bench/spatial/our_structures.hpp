#pragma once
// Top-level structures built by rtstdb/accel itself, without transactions and queries: what a tick pays when
// everything has moved.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <rtstdb/entity.hpp>
#include <rtstdb/geometry.hpp>

namespace hil::bench {

class OurTlas {
 public:
  /// As many instances of the mesh as there are places; they stand still. Without `refits` every structure
  /// is built anew.
  OurTlas(const rtstdb::TriangleMesh& mesh, std::span<const rtstdb::Pose> places, bool refits);
  ~OurTlas();
  OurTlas(const OurTlas&) = delete;
  OurTlas& operator=(const OurTlas&) = delete;

  /// Moves every row; the structure does not know yet.
  void place(std::span<const rtstdb::Pose> places);
  /// Brings the structure to the rows by patching or rebuilding, as rtstdb/accel decides. Returns the seconds that the device
  /// itself was busy.
  double update();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// One mesh whose corners move.
class OurDeforming {
 public:
  explicit OurDeforming(const rtstdb::TriangleMesh& mesh);
  ~OurDeforming();
  OurDeforming(const OurDeforming&) = delete;
  OurDeforming& operator=(const OurDeforming&) = delete;

  /// Brings the structure to these positions by patching or rebuilding, as rtstdb/accel decides. Returns the seconds that the device
  /// itself was busy.
  double update(std::span<const glm::vec3> positions_m);
  /// Trees that were built anew for it.
  std::uint64_t builds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Nodes and triangles on the device.
std::size_t our_mesh_bytes(const rtstdb::TriangleMesh& mesh);
/// All that searches read on the device, of one version with so many entities.
std::size_t our_version_bytes(std::uint32_t entities);

}  // namespace hil::bench
