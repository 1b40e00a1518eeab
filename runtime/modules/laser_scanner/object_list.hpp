#pragma once
// From hits to an object list, as a laser scanner's own controller makes it. Hits are told apart by the body
// they met (an ideal segmentation; everything else is measured): each hit is moved by the body's measured
// velocity to one instant, which undoes the distortion of the sweep, and the box around them gives the
// object's centre and its length along its velocity. An object is closed when the sweep has passed it by some
// columns.
//
// World frame. No allocation after construction.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/entity.hpp>

namespace hil::modules {

struct ScannedObject {
  rtstdb::EntityId entity;
  std::int64_t time_ns = 0;  ///< the instant of everything below
  glm::dvec3 center_m{0.0};
  glm::dvec3 velocity_mps{0.0};
  double length_m = 0.0;  ///< seen, along the velocity
  std::uint32_t hits = 0;
};

class ObjectList {
 public:
  struct Options {
    std::uint32_t max_open =
        64;  ///< bodies in sight of the beam at once; hits on further ones are passed over and counted
    std::uint32_t max_objects = 4;  ///< the nearest are kept
    std::uint32_t gap_columns = 3;  ///< columns without a hit that close an object
    std::uint32_t min_hits = 3;
    std::int64_t keep_ns = 0;  ///< how long an object stands in the list without being seen again
  };
  explicit ObjectList(const Options& options);

  /// A hit on a body of interest, in the order of time.
  void add(rtstdb::EntityId entity, std::uint32_t column, std::int64_t time_ns, const glm::dvec3& p_world_m,
           const glm::dvec3& v_world_mps) noexcept;
  /// The sweep has come to `column`: closes what lies behind it. `near_m`: distances are from here.
  void advance(std::uint32_t column, std::int64_t time_ns, const glm::dvec3& near_m) noexcept;
  /// The sweep is over: closes everything.
  void end_sweep(std::int64_t time_ns, const glm::dvec3& near_m) noexcept;
  /// Drops objects not seen for keep_ns.
  void forget(std::int64_t time_ns) noexcept;

  /// In the order of their slots: an object keeps its slot as long as it is seen.
  std::span<const ScannedObject> slots() const noexcept { return slots_; }
  std::uint64_t passed_over() const noexcept { return passed_over_; }

 private:
  struct Open {
    rtstdb::EntityId entity;
    std::uint32_t last_column = 0;
    std::int64_t reference_ns = 0;
    glm::dvec3 low_m{0.0}, high_m{0.0}, velocity_sum{0.0};
    double along_low_m = 0.0, along_high_m = 0.0;
    std::uint32_t hits = 0;
  };
  void close(const Open& open, std::int64_t time_ns, const glm::dvec3& near_m) noexcept;

  const Options options_;
  std::vector<Open> open_;
  std::vector<ScannedObject> slots_;
  std::uint64_t passed_over_ = 0;
};

}  // namespace hil::modules
