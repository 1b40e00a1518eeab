#pragma once
// Structures built by Embree.

#include <cstdint>
#include <memory>
#include <span>

#include <rtstdb/entity.hpp>
#include <rtstdb/geometry.hpp>

namespace hil::bench {

/// A scene of static instances whose transformations are replaced.
class EmbreeTlas {
 public:
  enum class Quality : std::uint8_t {
    low,  ///< quality of the scene
    /// Quality of the instances; scenes have no refit and use the default, which is faster here than low
    refit,
  };
  EmbreeTlas(const rtstdb::TriangleMesh& mesh, std::span<const rtstdb::Pose> places, Quality quality);
  ~EmbreeTlas();
  EmbreeTlas(const EmbreeTlas&) = delete;
  EmbreeTlas& operator=(const EmbreeTlas&) = delete;

  /// Computes the matrices without passing them to Embree.
  void place(std::span<const rtstdb::Pose> places);
  /// Sets and commits every instance, then the scene.
  void update();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Scenes of one mesh, quality medium.
class EmbreeBlas {
 public:
  EmbreeBlas();
  ~EmbreeBlas();
  EmbreeBlas(const EmbreeBlas&) = delete;
  EmbreeBlas& operator=(const EmbreeBlas&) = delete;

  /// Replaces the scene by a new one with a copy of the mesh.
  void build(const rtstdb::TriangleMesh& mesh);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// One mesh with moving vertices, refitted.
class EmbreeDeforming {
 public:
  explicit EmbreeDeforming(const rtstdb::TriangleMesh& mesh);
  ~EmbreeDeforming();
  EmbreeDeforming(const EmbreeDeforming&) = delete;
  EmbreeDeforming& operator=(const EmbreeDeforming&) = delete;

  /// Copies the positions and commits.
  void update(std::span<const glm::vec3> positions_m);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hil::bench
