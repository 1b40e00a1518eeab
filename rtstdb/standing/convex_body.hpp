#pragma once
// Convex bodies with few corners: the regions and rays of standing queries (boxes, frusta, segments), in the
// frame of their carrier.

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>

#include <array>
#include <cstddef>
#include <span>

namespace rtstdb::standing {

/// A vector of at most `most` values, without heap memory.
template <class Value, std::size_t most>
class FixedVector {
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
  double offset_m = 0.0;              ///< of its plane along `outward`
};

struct ConvexBody {
  FixedVector<glm::dvec3, 8> corners_m;
  FixedVector<Face, 6> faces;          ///< of boxes and frusta only
  FixedVector<glm::dvec3, 5> normals;  ///< unit normals of the faces, each direction once
  FixedVector<glm::dvec3, 6> edges;    ///< unit directions of the edges, each once
  double reach_m = 0.0;                ///< distance of the farthest corner from the frame's origin
};

/// A box with its centre at center_m and the orientation q (unit quaternion).
ConvexBody box_body(const glm::dvec3& center_m, const glm::dquat& q, const glm::dvec3& half_extent_m);
/// A frustum as in Region.
ConvexBody frustum_body(const glm::dvec3& eye_m, const glm::dquat& q, double near_m,
                        const glm::dvec3& far_half_extent_m);
/// A segment with these ends; `direction` is its unit direction.
ConvexBody segment_body(const glm::dvec3& first_m, const glm::dvec3& last_m, const glm::dvec3& direction);

}  // namespace rtstdb::standing
