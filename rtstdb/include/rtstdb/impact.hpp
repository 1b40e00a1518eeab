#pragma once
// The first time of impact: when two bodies that keep their motion come nearer to each other than a tolerance
// (paper, Section 4, Intersection Query, extended by time). Bodies move and turn as their rows say. The
// query also finds impacts that are shorter than any time step.
//
//   body      As for contacts (contact.hpp): pairs of convex bodies, or of surfaces. Geometry that deforms
//             keeps its shape in the window. Whether a body lies within the other one of a pair of surfaces
//             without touching it is tested at the begin of the window alone, by one corner of each surface.
//   frame     World axes. Points are relative to the first entity's origin at the time of the impact.
//   time      Each search has its own begin (query.hpp); its window is at most max_impact_window_ns long.
//   order     An answer depends neither on earlier ones nor on the order of the batch.
//   threads   as all queries (query.hpp)
// Source: conservative advancement (Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems", 1996).

#include <glm/ext/vector_float3.hpp>

#include <cstdint>
#include <span>
#include <string>

#include <rtstdb/prepared_query.hpp>

namespace rtstdb {

class ImpactQuery;

/// A body, and another one or all whose mask `second_mask` admits, from `t` to `t` + `window`. Both named
/// entities must have a geometry (no_geometry).
struct ImpactSearch {
  EntityId first{};
  EntityId second{};  ///< default: every other entity that second_mask admits
  std::uint32_t second_mask = mask_all;
  WorldTime t{};
  Nanoseconds window{1'000'000'000};  ///< 0 to max_impact_window_ns
  float tolerance_m = 0.001f;         ///< min_impact_tolerance_m to max_contact_margin_m
};

enum class ImpactStatus : std::uint8_t {
  none,       ///< no pair comes that near in the window
  impact,     ///< `second` comes nearer than the tolerance `after` the begin of the window
  undecided,  ///< no pair comes that near before `after`; whether one does later is not known (`reason`)
};

/// Why an answer is undecided.
enum class UndecidedReason : std::uint8_t {
  none,  ///< it is decided
  /// The pair with `second` needs more than max_impact_steps steps: the bodies stay near one another, within
  /// some tolerances, for a long time compared with their size over their speed.
  steps,
  /// The distance of the pair with `second` at `after` is not known well enough to decide whether the bodies
  /// are within the tolerance: the bounds of its search do not decide it, or the search reached its limit of
  /// work.
  distance,
  /// `overflow`: the named pair does not fit into the batch and was not searched. `second` is invalid, and
  /// `after` is 0.
  capacity,
};

struct ImpactAnswer {
  ImpactStatus status = ImpactStatus::none;
  UndecidedReason reason = UndecidedReason::none;
  EntityId second{};  ///< invalid: none
  /// From the begin of the window; 0: the pair is that near already, or penetrates.
  Nanoseconds after{0};
  float distance_m = 0.0f;    ///< then; 0: the bodies touch or penetrate
  glm::vec3 p_first_m{0.0f};  ///< then: midway between the nearest points, from the first entity's origin
  glm::vec3 n_world{0.0f};    ///< unit, from the second body to the first; zero where distance_m is 0
  /// World frame: velocity of the first body at the point, minus that of the second.
  glm::vec3 v_relative_mps{0.0f};
  std::uint32_t candidates = 0;  ///< pairs whose bounding spheres come that near in the window
  /// There are more candidates than candidates_per_search, of which those with the lowest indices were
  /// searched, or the batch has more pairs of convex parts and pairs of surfaces than capacity times
  /// candidates_per_search. A named pair that does not fit is undecided for lack of capacity.
  bool overflow = false;
  bool incomplete = false;  ///< a search reached the device's limits: nothing follows from the answer
};

struct ImpactQueryOptions {
  using Prepared = ImpactQuery;
  std::string name{};          ///< for reports and error texts
  std::uint32_t capacity = 0;  ///< searches in a batch: 1 to max_contact_searches
  /// At least 1; capacity times candidates_per_search is at most max_contact_candidates.
  std::uint32_t candidates_per_search = 64;
  LatePolicy late = LatePolicy::discard;
};

/// First times of impact. `searches` has `capacity` elements; `answers` has one for each search of the last
/// transaction. If several first impacts have one time, the answer is that with the lowest entity index.
/// Precision: at the time of the answer the distance is between 0 and the tolerance, and at no earlier time
/// it is below half of that. Where 4 units in the last place of the larger body's coordinates exceed a tenth
/// of the tolerance, these take its place; over distance_m they are also the error of n_world, in radians.
/// Poses of bodies that turn fast are rounded (entity.hpp), and the distance by as much.
/// distance_m of surfaces may be too large by a tenth. Where the tested corner of a surface lies within the
/// other body at the begin of the window, distance_m is 0 and p_first_m is that corner, also if the surfaces
/// touch elsewhere.
class ImpactQuery : public Query {
 public:
  virtual std::span<ImpactSearch> searches() noexcept = 0;
  virtual std::span<const ImpactAnswer> answers() const noexcept = 0;
};

const char* to_string(ImpactStatus status) noexcept;
const char* to_string(UndecidedReason reason) noexcept;

}  // namespace rtstdb
