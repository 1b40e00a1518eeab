#pragma once
// Inputs of the spatial suite: meshes and rays generated from a fixed seed, the same for both sides.

#include <cstdint>
#include <vector>

#include <rtstdb/entity.hpp>
#include <rtstdb/geometry.hpp>
#include <rtstdb/query.hpp>

namespace hil::bench {

/// SplitMix64: small, and the same on every machine.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() noexcept {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }
  /// In [low, high).
  float between(float low, float high) noexcept {
    return low + (high - low) * static_cast<float>(next() >> 40) * 0x1p-24f;
  }
  glm::vec3 in_box(const glm::vec3& half) noexcept {
    return {between(-half.x, half.x), between(-half.y, half.y), between(-half.z, half.z)};
  }
  glm::vec3 direction() noexcept;

 private:
  std::uint64_t state_;
};

/// A closed lumpy body around the origin with a radius of roughly 1 m and 2 * rows * columns - 2 * columns
/// triangles.
rtstdb::TriangleMesh lumpy_body(std::uint32_t rows, std::uint32_t columns, std::uint64_t seed);

/// The body inside a lumpy open bowl of four times its size, as one mesh of about 4 * rows^2 triangles. Rays
/// from inside the bowl must traverse nodes even if they miss.
rtstdb::TriangleMesh body_in_bowl(std::uint32_t rows, std::uint64_t seed);

/// HIL_TEST_DATA's meshes/stanford-bunny.obj with 69,451 triangles; without it another body of its size, and
/// a message on stderr; tiny: a small body. Throws std::runtime_error for an invalid file.
rtstdb::TriangleMesh bunny(bool tiny);

/// Triangles at random places with sizes from some millimetres to half a metre.
rtstdb::TriangleMesh triangle_soup(std::uint32_t count, std::uint64_t seed);

/// A camera in the bowl that looks past the body: neighbouring rays are coherent; two thirds of them hit.
std::vector<rtstdb::Ray> camera_rays(std::uint32_t width, std::uint32_t height);
/// Random origins in the bowl and random directions; three quarters of the rays hit.
std::vector<rtstdb::Ray> scattered_rays(std::uint32_t count, std::uint64_t seed);

/// Bodies of 2,048 to 5,000 triangles, about a metre in size, moving at up to 20 m/s and rotating at up to 5
/// rad/s.
struct MovingBodies {
  std::vector<rtstdb::TriangleMesh> meshes;  ///< four
  std::vector<rtstdb::EntityRow> rows;       ///< geometry.index is the mesh's
};
MovingBodies moving_bodies(std::uint32_t count, float half_m, std::uint64_t seed);
/// Random origins in the box of that half size, random directions, random times in [0, window_ns].
std::vector<rtstdb::Ray> timed_rays(std::uint32_t count, float half_m, float lambda_max,
                                    std::int64_t window_ns, std::uint64_t seed);

/// Axis-aligned boxes of 0.5 m to 1.5 m a side at random places in a box of that half size, as instances of a
/// box of 1 m.
std::vector<rtstdb::EntityRow> strewn_boxes(std::uint32_t count, float half_m, std::uint64_t seed);

}  // namespace hil::bench
