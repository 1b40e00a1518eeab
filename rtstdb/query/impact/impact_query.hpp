#pragma once
// The impact query on the GPU, in stages with a pass over their places each: `candidates` searches the
// entities that a body may meet (shaders/query/impact/impact_candidates.comp); then each `advance` stage
// makes some steps of conservative advancement for the pairs that are not decided yet
// (impact_advance.comp), and `surfaces` stages do so for pairs of which a body has no convex parts
// (impact_surfaces.comp). Between the stages the host drops pairs that can not be the first to meet.

#include <cstdint>
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
  /// Stage 0 searches candidates. advance_stages stages advance pairs of convex parts, then surface_stages
  /// stages advance pairs of surfaces. The last stage has no places: it writes the answers.
  static constexpr std::uint32_t advance_stages = shared::max_convex_steps;
  static constexpr std::uint32_t surface_stages = shared::max_surface_steps;
  static constexpr std::uint32_t last_advance_stage = advance_stages + surface_stages;
  static bool advances_surfaces(std::uint32_t stage) noexcept { return stage > advance_stages; }

  /// A pair of convex parts, or of surfaces.
  struct Pair {
    std::uint32_t search = 0;
    EntityId second;
    WorldTime t{};  // begin of the window
    bool is_surfaces = false;
  };

  DeviceNeeds device_needs(const gpu::DeviceLimits& limits) override;
  std::vector<const gpu::Buffer*> bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                const accel::GeometryPool& pool,
                                                const accel::Tlas& tlas) const override;
  void unpack(const BatchPart& part, const accel::TlasView& view) noexcept override;
  bool is_incomplete(std::uint32_t place) const noexcept override;
  void mark_incomplete(std::uint32_t search) noexcept override;
  std::uint32_t stages() const noexcept override { return last_advance_stage + 2; }
  std::uint32_t begin_first_stage(std::uint32_t count, const BatchWorld& world) noexcept override;
  std::uint32_t begin_stage(std::uint32_t stage, const BatchWorld& world) noexcept override;

  void pack_sweep(std::uint32_t place, const Recording& recording) const noexcept;
  void add_pairs(const BatchWorld& world) noexcept;
  void add_pair(std::uint32_t search, EntityId second, const BatchWorld& world) noexcept;
  void add_record(const Pair& pair, const shared::AdvanceRecord& record) noexcept;
  std::uint32_t list_active_pairs(bool surfaces) noexcept;
  void write_answers(const BatchWorld& world) noexcept;
  ImpactAnswer answer_of(const Pair& pair, const shared::AdvanceState& state,
                         const BatchWorld& world) const noexcept;
  double time_of(std::uint32_t pair) const noexcept;
  ImpactAnswer& written(std::uint32_t search) noexcept { return answers_[slots().written()][search]; }

  const ImpactQueryOptions options_;
  std::vector<ImpactSearch> searches_;
  std::vector<std::uint32_t> sweeps_;               // searches of all entities, by place of the first stage
  std::vector<Pair> pairs_;                         // by search, then by entity
  std::vector<double> first_s_;                     // of each search: the earliest impact so far
  std::vector<std::vector<ImpactAnswer>> answers_;  // one per answer slot
  std::uint32_t count_ = 0;                         // searches of the batch
  std::uint32_t active_count_ = 0;                  // pairs of the last stage

  gpu::Buffer sweeps_buffer_, counts_, ids_;
  gpu::Buffer records_, states_, active_;
};

}  // namespace rtstdb::query
