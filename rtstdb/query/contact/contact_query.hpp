#pragma once
// The contact query on the GPU, in stages with a pass over their places each:
//
//   candidates       a search of the tree for each body: the bodies whose oriented bounds overlap its bounds
//   more candidates  the same for bodies that have more than fit into their first list
//   distance         GJK for each pair of convex parts, in single precision
//                    (shaders/query/contact/contact_distance.comp)
//   double distance  the same in double precision for pairs that single precision does not decide
//   depth            EPA for those that overlap, in double precision (contact_depth.comp)
//   surface bounds, near, gaps, insides, samples, descents
//                    searches of the triangles of pairs of surfaces (surface_pairs.hpp)
//   points           of convex pairs that touch or are within the margin: their faces clipped against each
//                    other (contact_points.comp)
//   surface refined, feet
//                    of pairs of surfaces: the exact depth of the points (surface_pairs.hpp)
//
// Between stages the host compacts what the next one needs. From `distance` on, nothing depends on the tree:
// the pairs are in frames of their own (pair_frame.hpp).

#include <cstdint>
#include <span>
#include <vector>

#include "rtstdb/query/contact/contact_candidates.hpp"
#include "rtstdb/query/contact/pair_frame.hpp"
#include "rtstdb/query/gpu_query.hpp"

namespace rtstdb::query {

class GpuContactQuery final : public ContactQuery, public GpuQuery {
 public:
  /// The options have passed check_contact_options.
  explicit GpuContactQuery(const ContactQueryOptions& options);
  ~GpuContactQuery() override { leave(); }

  std::span<ContactSearch> searches() noexcept override { return searches_; }
  std::span<const ContactAnswer> answers() const noexcept override {
    return {answers_[slots().read()].of_searches.data(), slots().readable()};
  }
  const AnswerInfo& answer_info() const noexcept override { return info; }

  CostClass cost_class() const noexcept override { return CostClass::contact; }
  std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                TimeSpan& times) const noexcept override;
  void record(const BatchPart& part, const Recording& recording) noexcept override;
  std::uint32_t incomplete(std::uint32_t answered) const noexcept override;

  /// Allocates what the host reads and writes. Called after the first move_to, which refuses a query that the
  /// device can not hold.
  void allocate_host_memory();

 private:
  /// surface_samples, surface_descents and surface_refined are the first of several stages.
  enum Stage : std::uint32_t {
    candidates,
    more_candidates,
    distance,
    double_distance,
    depth,
    surface_bounds,
    surface_near,
    surface_gaps,
    surface_insides,
    surface_samples,
    surface_descents = surface_samples + SurfacePairs::sample_stages,
    points = surface_descents + SurfacePairs::descent_stages,
    surface_refined,
    surface_feet = surface_refined + SurfacePairs::refining_stages,
    stage_count
  };

  struct Answers {
    std::vector<ContactPair> pairs;
    std::vector<ContactAnswer> of_searches;  // with spans of `pairs`
  };
  /// A pair of parts of the stage `points`.
  struct Touching {
    std::uint32_t pair = 0;
    std::uint32_t answered = 0;  // number in Answers::pairs
    bool is_done = false;
  };
  /// An answered pair of surfaces.
  struct ListedSurfaces {
    std::uint32_t answered = 0;  // number in Answers::pairs
    std::uint32_t pair = 0;      // of surfaces_
    std::uint32_t search = 0;
  };
  /// Range of an answered pair: touching_pairs_[first, end).
  struct TouchingRange {
    std::uint32_t first = 0, end = 0;
  };

  DeviceNeeds device_needs(const gpu::DeviceLimits& limits) override;
  std::vector<const gpu::Buffer*> bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                const accel::GeometryPool& pool,
                                                const accel::Tlas& tlas) const override;
  void unpack(const BatchPart& part, const accel::TlasView& view) noexcept override;
  bool is_incomplete(std::uint32_t place) const noexcept override;
  void mark_incomplete(std::uint32_t search) noexcept override;
  std::uint32_t stages() const noexcept override { return stage_count; }
  std::uint32_t begin_first_stage(std::uint32_t count, const BatchWorld& world) noexcept override;
  std::uint32_t begin_stage(std::uint32_t stage, const BatchWorld& world) noexcept override;

  static gpu::ShaderId shader_of(std::uint32_t stage) noexcept;
  const Kernel& kernel_of(std::uint32_t stage) const noexcept;
  std::uint32_t begin_more_candidates() noexcept;
  std::uint32_t begin_distance(const BatchWorld& world) noexcept;
  /// Lists the pairs of parts that a stage left in this state.
  std::uint32_t list_pairs(std::uint32_t state) noexcept;
  std::uint32_t begin_points(const BatchWorld& world) noexcept;
  /// Appends a pair without its points to the answer, unless it is apart by more than the margin and not
  /// named.
  void list_pair(const ContactCandidates::Candidate& candidate, const BatchWorld& world) noexcept;
  /// Write the distance of a pair, or that it is undecided, from the results of the stages. False: a search
  /// is incomplete.
  bool judge_convex(const ContactCandidates::Candidate& candidate, ContactPair& pair) const noexcept;
  bool judge_surfaces(const ContactCandidates::Candidate& candidate, ContactPair& pair) const noexcept;
  void list_touching(const ContactCandidates::Candidate& candidate, const BatchWorld& world) noexcept;

  void pack_body(std::uint32_t record, const ContactCandidates::Body& body,
                 const Recording& recording) const noexcept;
  void pack_pairs(PlaceRange range, const Recording& recording) noexcept;
  void dispatch_search(const BatchPart& part, const Recording& recording) const noexcept;
  void dispatch_pairs(const BatchPart& part, const Recording& recording) const noexcept;
  std::uint32_t begin_surface_feet() noexcept;
  /// Writes the points of all answered pairs of surfaces.
  void write_surface_points(bool retry_follows) noexcept;
  /// Chooses the points of an answered pair among those of its pairs of parts.
  void choose_points(std::uint32_t answered) noexcept;
  std::uint32_t search_of(const Touching& touching) const noexcept {
    return candidates_.candidates()[candidates_.part_pairs()[touching.pair].candidate].search;
  }

  const ContactQueryOptions options_;
  const std::uint32_t max_candidates_;
  std::vector<ContactSearch> searches_;
  ContactCandidates candidates_;
  SurfacePairs surfaces_;
  std::vector<ListedSurfaces> listed_surfaces_;
  std::vector<Touching> touching_pairs_;
  std::vector<TouchingRange> touching_ranges_;  // by number in Answers::pairs
  std::vector<PairFrame> frames_;               // of touching_pairs_
  std::vector<Answers> answers_;                // one per answer slot
  std::uint32_t listed_ = 0;                    // of the pairs of the written answers
  std::uint32_t count_ = 0;                     // searches of the batch

  gpu::Buffer bodies_buffer_, counts_, spaces_, ids_;
  gpu::Buffer pairs_, results_, listed_pairs_, touching_, points_;
};

}  // namespace rtstdb::query
