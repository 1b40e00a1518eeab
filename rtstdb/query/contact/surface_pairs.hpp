#pragma once
// The pairs of surfaces of a batch of contact searches (pairs of which at least one body does not consist of
// convex parts), in stages:
//
//   bounds   for named pairs: an upper bound of the distance (shaders/query/contact/surface_bounds.comp)
//   near     the triangles of each surface that are near the other body (surface_near.comp)
//   gaps     for each of them: the distance to the other surface, or where it crosses that (surface_gap.comp)
//   insides  for each of them: whether it lies in the other body (surface_inside.comp)
//   samples  for each that crosses the other surface or lies inside: how deep some of its points are
//            (surface_descent.comp)
//   descents for those in which the pair's deepest point may lie: the deepest point (surface_descent.comp)
//   refined  for the deepest points that become contacts: descents from there by the body's triangles
//   feet     for all points that become contacts: their exact depth (surface_feet.comp)
//
// Between stages the host compacts what the next one needs. Each pair has two sides: number i for its first
// surface against its second body, and count() + i for the second surface against the first body.
//
// Threads: the engine thread. Only reserve allocates.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <rtstdb/contact.hpp>

#include "rtstdb/query/contact/pair_frame.hpp"
#include "rtstdb/query/contact/point_choice.hpp"
#include "rtstdb/query/gpu_query.hpp"
#include "shaders/shared/surface.h"

namespace rtstdb::query {

/// Points of a near triangle: its corners, its deepest point, and the middle of its gap.
enum TrianglePoint : std::uint32_t { corner_0, corner_1, corner_2, deepest_point, gap_point };

class SurfacePairs {
 public:
  /// As many stages as samples: a stage takes at least one sample of a search, so that every search ends.
  static constexpr std::uint32_t sample_stages = shared::descent_samples;
  static constexpr std::uint32_t descent_stages = shared::max_field_descent_steps;
  static constexpr std::uint32_t refining_stages = shared::max_triangle_descent_steps;

  /// The result for a pair after the stage `descents`.
  struct Verdict {
    float distance_m = 0.0f;     ///< 0: in contact; 3.4e38 or more: no gap within the limit, no normal
    glm::vec3 n_world{0.0f};     ///< unit, from the second body to the first, along the shortest segment
    bool is_undecided = false;   ///< its triangles did not fit
    bool is_incomplete = false;  ///< the search reached the device's limits
    bool has_depth = true;       ///< false: neither body has an inside
  };

  SurfacePairs(std::uint32_t max_pairs, std::uint32_t max_triangles)
      : max_pairs_(max_pairs), max_triangles_(max_triangles) {}
  void reserve();
  void add_buffers(const std::string& name, DeviceNeeds& needs);
  std::vector<const gpu::Buffer*> bound_buffers(gpu::ShaderId shader, const accel::GeometryPool& pool) const;

  /// Begins a batch.
  void clear() noexcept;
  /// Adds a pair and returns its number; nullopt: it does not fit. `is_named`: its distance is needed even
  /// beyond the margin.
  std::optional<std::uint32_t> add(const EntityRow& first, const EntityRow& second, WorldTime t,
                                   float margin_m, bool is_named, const accel::GeometryPool& pool) noexcept;
  std::uint32_t count() const noexcept { return static_cast<std::uint32_t>(pairs_.size()); }

  // Each begins a stage and returns its places.
  std::uint32_t begin_bounds() noexcept;
  std::uint32_t begin_near() noexcept;
  std::uint32_t begin_gaps() noexcept;
  std::uint32_t begin_insides() const noexcept { return static_cast<std::uint32_t>(near_.size()); }
  std::uint32_t begin_samples(bool is_first_stage) noexcept;
  std::uint32_t begin_descents(bool is_first_stage) noexcept;
  std::uint32_t begin_refining(bool is_first_stage) noexcept;
  std::uint32_t begin_feet() noexcept;

  /// Whether a place of the stage of this kernel was left incomplete.
  bool is_incomplete(gpu::ShaderId shader, std::uint32_t place) const noexcept;

  Verdict verdict(std::uint32_t pair) const noexcept;
  /// Chooses the points of a decided pair that is in contact or within the margin. Between `descents` and
  /// `refined`.
  void choose_points(std::uint32_t pair) noexcept;
  /// Writes the points of a pair, after `feet`, and the distance and the normal that follow from them. False:
  /// a search is incomplete. `retry_follows`: incomplete feet are queried once more, and then the points are
  /// written again.
  bool write_points(std::uint32_t pair, bool retry_follows, ContactPair& answer) const noexcept;

 private:
  /// A point that was chosen as a contact.
  struct Chosen {
    std::uint32_t near = 0;  ///< number in near_
    TrianglePoint point = gap_point;
    std::uint32_t foot = 0;  ///< its place in the stage `feet`; unused for a gap
  };
  struct Pair {
    BodyPoses poses;
    float margin_m = 0.0f;
    bool has_depth = false;
    bool exceeds_capacity = false;     ///< its triangles did not fit
    bool bound_is_incomplete = false;  ///< the search for an upper bound was left incomplete
    std::array<Chosen, 4> chosen{};
    std::uint32_t chosen_count = 0;
    std::optional<std::uint32_t> nearest_gap{};  ///< the near triangle of the first surface that has it
  };
  /// Of near_.
  struct NearRange {
    std::uint32_t first = 0, end = 0;
  };
  /// A point of a pair from the first entity's origin, and its normal from the second body to the first
  /// (unit); world axes.
  struct SidePoint {
    glm::vec3 p_first_m{0.0f};
    glm::vec3 n_world{0.0f};
  };

  void list_near(std::uint32_t side) noexcept;
  bool is_unfinished(std::uint32_t near) const noexcept;
  std::uint32_t list_active(std::uint32_t listed) noexcept;
  float deepest_sample_m(std::uint32_t pair) const noexcept;
  bool is_first_side(std::uint32_t side) const noexcept { return side < count(); }
  static SidePoint side_point(const Pair& pair, bool first_side, const glm::vec3& point_m,
                              const glm::vec3& outwards) noexcept;
  template <class Offer>
  void offer_points(std::uint32_t pair, const Offer& offer) const noexcept;
  ContactPoint contact_of(const Pair& pair, const Chosen& chosen) const noexcept;

  const std::uint32_t max_pairs_, max_triangles_;
  std::vector<Pair> pairs_;
  std::vector<shared::SurfaceSide> first_sides_, second_sides_;
  std::vector<NearRange> ranges_;           // of the sides
  std::vector<shared::NearTriangle> near_;  // as near_buffer_
  std::vector<std::uint32_t> named_;        // first sides of the named pairs
  std::uint32_t feet_count_ = 0;
  std::uint32_t active_count_ = 0;
  std::uint64_t words_ = 0;  // of bits_ that are in use

  gpu::Buffer sides_, named_buffer_, bounds_, bits_, states_, near_buffer_, gaps_, depths_, active_, points_,
      feet_;
};

}  // namespace rtstdb::query
