#pragma once
// Fixture that reads the TLAS of random worlds back from the device: at each instant of the window, the
// triangles of an entity are in the box of its leaf and of each node above, its oriented bounds exceed these
// boxes by at most the overhang that the nodes record, and no box is much larger than necessary.

#include <string>
#include <vector>

#include "rtstdb/accel/tlas.hpp"
#include "rtstdb/geometry/extents.hpp"
#include "tests/gpu/gpu_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/gpu/version_rows.hpp"

namespace rtstdb::test {

class MotionBoxFuzz : public gpu::test::GpuTest {
 protected:
  void SetUp() override;
  /// Checks four versions of the random world of this seed, whose tree is built, refitted and patched.
  void fuzz(std::uint64_t seed);

  std::size_t points() const { return points_; }
  std::size_t versions() const { return versions_; }
  accel::Tlas::Counts counts() const { return tlas_.counts(); }

 private:
  static constexpr std::uint32_t max_entities = 2400;

  struct Window {
    WorldTime begin{}, end{};
    double seconds() const { return seconds_between(begin, end); }
  };
  struct Scene {
    WorldTime time{};  ///< the version's
    Window window;
    double radius_m = 0.0;
    double offset_m = 0.0;  ///< from the world's origin
  };
  /// A child of a node.
  struct Child {
    std::uint32_t node = 0, slot = 0;
  };

  EntityRow row(const Scene& scene);
  void patch(Scene& scene, std::vector<EntityRow>& rows);
  void check_all(const Window& window);
  void visit(std::uint32_t node, std::vector<Child>& above);
  void check(const EntityRow& row, const std::vector<Child>& boxes, WorldTime t, const Window& window,
             float share);
  Bounds random_triangle_of(const TriangleMesh& mesh);

  Random random_{0};
  std::vector<TriangleMesh> meshes_;
  std::vector<Bounds> bounds_;
  std::vector<Extents> extents_;
  accel::Submit submit_;
  accel::GeometryPool pool_;
  accel::Tlas tlas_;
  VersionRows rows_{max_entities};
  gpu::Buffer read_back_;
  std::vector<std::vector<Child>> paths_;  // by place: from the root to the leaf
  std::size_t points_ = 0, versions_ = 0, outside_ = 0, too_large_ = 0;
  glm::dvec3 max_overhang_m_{0.0};  // of bounds over the boxes of their triangles
};

}  // namespace rtstdb::test
