#pragma once
// Random worlds whose trees of entities are read back from the device: at any instant of the window, no
// triangle of an entity may stand outside of the box of its leaf or of any node above, nor may its oriented
// bounds by more than those nodes tell; and no box may be much larger than it has to be.

#include <string>
#include <vector>

#include "rtstdb/accel/tlas.hpp"
#include "rtstdb/geometry/extents.hpp"
#include "tests/gpu/gpu_test.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/gpu/version_rows.hpp"

namespace rtstdb::test {

class MotionBoxFuzz : public gpu::test::GpuTest {
 protected:
  void SetUp() override;
  /// The world of this seed in some versions, so that its tree is built, refitted and patched. Fails the test
  /// with the seed.
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
    double far_m = 0.0;  ///< from the world's origin
  };
  /// A child of a node: the box that stands for what is below it.
  struct Child {
    std::uint32_t node = 0, slot = 0;
  };

  EntityRow row(const Scene& scene);
  void patch(Scene& scene, std::vector<EntityRow>& rows);
  void look(const Window& window);
  void walk(std::uint32_t node, std::vector<Child>& above);
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
  glm::dvec3 stands_out_m_{0.0};  // bounds out of what holds their triangles, at most
};

}  // namespace rtstdb::test
