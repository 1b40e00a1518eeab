#pragma once
// A watertight ray-triangle test: no ray passes between triangles that share an edge.

#include <glm/ext/vector_double3.hpp>

#include <array>
#include <optional>

#include "rtstdb/oracle/mesh_tree.hpp"

namespace rtstdb::oracle {

struct TriangleHit {
  double lambda = 0.0;
  double u = 0.0, v = 0.0;  ///< weights of the second and third corner
};

/// Each corner is sheared so that the ray becomes the third axis; then the signs of three edge functions
/// decide. The edge function of a shared edge has the same value with opposite sign in both triangles, to the
/// last bit, so no ray passes between. Borders count as inside. None for a triangle that has no area along
/// the ray (edge-on). lambda lies in [lambda_min, lambda_max].
class WatertightTest {
 public:
  explicit WatertightTest(const LocalRay& ray) noexcept;
  std::optional<TriangleHit> operator()(const std::array<glm::dvec3, 3>& corners, double lambda_min,
                                        double lambda_max) const noexcept;

 private:
  glm::dvec3 origin_;
  int x_, y_, z_;  ///< the ray's largest component is its z_
  double shear_x_, shear_y_, shear_z_;
};

}  // namespace rtstdb::oracle
