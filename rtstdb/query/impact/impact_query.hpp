#pragma once
// The impact query on the GPU, in stages with a pass over their places each: stage 0 searches the entities
// that a body may meet (shaders/query/impact/impact_candidates.comp); then stages make some steps of
// conservative advancement for the pairs of convex parts that are not decided yet (impact_advance.comp), as
// many as these need, and further stages do so for pairs of which a body has no convex parts
// (impact_surfaces.comp). Between the stages the host drops pairs that can not be the first to meet. The last
// stage has no places: it writes the answers.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "rtstdb/query/gpu_query.hpp"
#include "shaders/shared/impact.h"

namespace rtstdb::query {

class GpuImpactQuery final : public ImpactQuery, public GpuQuery {
 public:
  /// The options have passed check_impact_options.
  explicit GpuImpactQuery(const ImpactQueryOptions& options);
  ~GpuImpactQuery() override { leave(); }

  std::span<ImpactSearch> searches() noexcept override { return searches_; }
  std::span<const ImpactAnswer> answers() const noexcept override {
    return std::span(answers_[slots().read()]).first(slots().readable());
  }
  const AnswerInfo& answer_info() const noexcept override { return info; }

  CostClass cost_class() const noexcept override { return CostClass::impact; }
  std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                TimeSpan& times) const noexcept override;
  void record(const BatchPart& part, const Recording& recording) noexcept override;
  std::uint32_t incomplete(std::uint32_t answered) const noexcept override;

  /// Allocates what the host reads and writes. Called after the first move_to, which refuses a query that the
  /// device can not hold.
  void allocate_host_memory();

 private:
  enum class Phase : std::uint8_t { candidates, convex, surfaces, answered };

  /// A pair of convex parts, or of surfaces.
  struct Pair {
    std::uint32_t search = 0;
    EntityId second;
    WorldTime t{};  // begin of the window
    bool is_surfaces = false;
  };
  /// The first event of a search so far: a pair meets, or is undecided. Of several at one time, that of the
  /// first pair, which has the lowest entity index.
  struct FirstEvent {
    double time_s = std::numeric_limits<double>::infinity();
    std::uint32_t pair = 0;
  };

  DeviceNeeds device_needs(const gpu::DeviceLimits& limits) override;
  std::vector<const gpu::Buffer*> bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                const accel::GeometryPool& pool,
                                                const accel::Tlas& tlas) const override;
  void unpack(const BatchPart& part, const accel::TlasView& view) noexcept override;
  bool is_incomplete(std::uint32_t place) const noexcept override;
  void mark_incomplete(std::uint32_t search) noexcept override;
  /// As many as the pairs need.
  std::uint32_t stages() const noexcept override {
    return phase_ == Phase::answered ? stage() + 1 : std::numeric_limits<std::uint32_t>::max();
  }
  std::uint32_t begin_first_stage(std::uint32_t count, const BatchWorld& world) noexcept override;
  std::uint32_t begin_stage(std::uint32_t stage, const BatchWorld& world) noexcept override;

  void pack_sweep(std::uint32_t place, const Recording& recording) const noexcept;
  void add_pairs(const BatchWorld& world) noexcept;
  void add_pair(std::uint32_t search, EntityId second, const BatchWorld& world) noexcept;
  void add_record(const Pair& pair, const shared::AdvanceRecord& record) noexcept;
  bool is_out_of_steps(std::uint32_t pair) const noexcept;
  bool is_before(std::uint32_t pair, const FirstEvent& event) const noexcept;
  /// Whether the pair makes further steps: it is not decided and may be the first of its search to meet.
  bool goes_on(std::uint32_t pair) const noexcept;
  void note_event(std::uint32_t pair) noexcept;
  std::uint32_t list_convex() noexcept;
  /// Frees the slots of pairs that do not go on, and gives them to the next pairs.
  std::uint32_t list_surfaces(std::uint64_t shapes) noexcept;
  void write_answers(const BatchWorld& world) noexcept;
  void write_event(std::uint32_t pair, ImpactAnswer& answer, const BatchWorld& world) const noexcept;
  std::uint32_t max_pairs() const noexcept { return options_.capacity * options_.candidates_per_search; }
  std::uint32_t surface_slots() const noexcept { return std::min(max_pairs(), shared::max_surface_slots); }
  double time_of(std::uint32_t pair) const noexcept;
  ImpactAnswer& written(std::uint32_t search) noexcept { return answers_[slots().written()][search]; }

  const ImpactQueryOptions options_;
  std::vector<ImpactSearch> searches_;
  std::vector<std::uint32_t> sweeps_;               // searches of all entities, by place of the first stage
  std::vector<Pair> pairs_;                         // by search, then by entity
  std::vector<FirstEvent> first_events_;            // of each search
  std::vector<std::uint32_t> slot_pairs_;           // by slot for paused searches; no_pair: it is free
  std::vector<std::vector<ImpactAnswer>> answers_;  // one per answer slot
  std::uint32_t count_ = 0;                         // searches of the batch
  Phase phase_ = Phase::candidates;
  std::uint32_t next_surfaces_ = 0;  // no pair of surfaces before this one waits for a slot
  std::uint64_t shapes_ = 0;         // GeometryPool::shown() at the last stage of surfaces
  std::uint32_t shape_changes_ = 0;  // stages of surfaces before which the shapes were shown anew

  gpu::Buffer sweeps_buffer_, counts_, ids_;
  gpu::Buffer records_, states_, active_;
  gpu::Buffer active_surfaces_, searches_buffer_, subtree_pairs_;
};

}  // namespace rtstdb::query
