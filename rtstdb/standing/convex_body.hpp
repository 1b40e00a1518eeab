#pragma once
// Convex bodies of few corners, as questions are asked with: boxes, frusta, rays cut to a length. In the frame that carries them.

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>

#include <array>
#include <cstddef>
#include <span>

namespace rtstdb::standing {

/// At most so many of a kind, without a heap.
template <class Value, std::size_t most>
class Few {
 public:
  void add(const Value& value) { values_[count_++] = value; }
  std::size_t size() const { return count_; }
  const Value& operator[](std::size_t i) const { return values_[i]; }
  const Value* begin() const { return values_.data(); }
  const Value* end() const { return values_.data() + count_; }

 private:
  std::array<Value, most> values_{};
  std::size_t count_ = 0;
};

struct Face {
  glm::dvec3 outward{1.0, 0.0, 0.0};  ///< unit
  double offset_m = 0.0;              ///< of its plane along that
};

struct ConvexBody {
  Few<glm::dvec3, 8> corners_m;
  Few<Face, 6> faces;          ///< of boxes and frusta
  Few<glm::dvec3, 5> normals;  ///< unit; directions of the faces, each once
  Few<glm::dvec3, 6> edges;    ///< unit, each direction once
  double reach_m = 0.0;        ///< of the farthest corner from the frame's origin
};

/// A box placed at center_m and turned by the unit quaternion q.
ConvexBody box_body(const glm::dvec3& center_m, const glm::dquat& q, const glm::dvec3& half_extent_m);
/// As Region tells of a frustum.
ConvexBody frustum_body(const glm::dvec3& eye_m, const glm::dquat& q, double near_m,
                        const glm::dvec3& far_half_extent_m);
/// From one end to the other along a unit direction, for which the ends tell where they are.
ConvexBody segment_body(const glm::dvec3& first_m, const glm::dvec3& last_m, const glm::dvec3& direction);

}  // namespace rtstdb::standing
