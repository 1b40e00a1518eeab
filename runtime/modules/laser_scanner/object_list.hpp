#pragma once
// Makes an object list of the hits of a sweep, as the controller of a laser scanner does. Segmentation is
// ideal: the body that a hit met is known. Everything else is measured. Each hit is moved by the measured
// velocity to one instant, which removes the distortion of the sweep; the box around the moved hits gives
// the object's centre and its length along its velocity. An object is closed when the sweep is some columns
// past it.
//
// World frame. No allocation after construction. Threads: one.

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
  double length_m = 0.0;  ///< measured, along the velocity
  std::uint32_t hits = 0;
};

class ObjectList {
 public:
  struct Options {
    std::uint32_t max_open = 64;    ///< open objects at once; hits of further bodies are ignored and counted
    std::uint32_t max_objects = 4;  ///< slots of the list; the nearest objects are kept
    std::uint32_t gap_columns = 3;  ///< columns without a hit that close an object
    std::uint32_t min_hits = 3;
    std::int64_t keep_ns = 0;  ///< how long an object stays in the list after its last measurement
  };
  explicit ObjectList(const Options& options);

  /// Adds a hit. Hits come in the order of their times.
  void add(rtstdb::EntityId entity, std::uint32_t column, std::int64_t time_ns, const glm::dvec3& p_world_m,
           const glm::dvec3& v_world_mps) noexcept;
  /// The sweep has reached `column`: closes the objects that lie more than gap_columns behind it. Of too many
  /// objects, those nearest to `near_m` are kept.
  void advance(std::uint32_t column, std::int64_t time_ns, const glm::dvec3& near_m) noexcept;
  /// The sweep is over: closes all objects.
  void end_sweep(std::int64_t time_ns, const glm::dvec3& near_m) noexcept;
  /// Removes objects that were not measured for keep_ns.
  void forget(std::int64_t time_ns) noexcept;

  /// The slots; a free one has an invalid entity. An object keeps its slot as long as it is measured.
  std::span<const ScannedObject> slots() const noexcept { return slots_; }
  /// The number of hits that were ignored since max_open objects were open.
  std::uint64_t ignored_hits() const noexcept { return ignored_hits_; }

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
  std::uint64_t ignored_hits_ = 0;
};

}  // namespace hil::modules
