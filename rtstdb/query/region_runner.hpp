#pragma once
// The region shaders with their buffers, used by the region and the overlap query: both ask what meets a region
// at one instant.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rtstdb/query/gpu_query.hpp"
#include "rtstdb/query/id_order.hpp"
#include "rtstdb/query/late_policy.hpp"
#include "shaders/shared/query.h"

namespace rtstdb::query {

/// Regions that one shader answers are a kind: those of one shape, but that boxes and spheres share theirs at
/// RegionLevel::bounds.
inline constexpr std::size_t region_kinds = 3;
constexpr std::size_t region_kind(RegionLevel level, RegionShape shape) noexcept {
  return level == RegionLevel::bounds && shape == RegionShape::sphere ? 0 : static_cast<std::size_t>(shape);
}
/// Where each kind ends in a batch that has one after the other.
using RegionKindEnds = std::array<std::uint32_t, region_kinds>;

struct RegionRunnerOptions {
  std::string name;
  std::uint32_t capacity = 0;
  RegionLevel level = RegionLevel::bounds;
  std::uint32_t ids_per_region = 0;  ///< 0: only counts
  bool frusta = false;               ///< may be asked
  LatePolicy late = LatePolicy::discard;
};

class RegionRunner {
 public:
  static Result<RegionRunner> create(gpu::Device& device, const RegionRunnerOptions& options);
  // See GpuQuery.
  Result<void> move_to(gpu::Device& device);
  void leave_device() noexcept;
  Result<void> bind(gpu::Device& device, const accel::GeometryPool& pool, const accel::Tlas& tlas);

  std::span<shared::RegionRecord> records() const noexcept {
    return records_.host_as<shared::RegionRecord>();
  }
  void record_warm_up(gpu::Recorder& recorder) noexcept;
  /// A batch begins. `order`: whose record stands at each place, kind after kind; it has to stay until the answers are
  /// unpacked.
  void begin_batch(std::span<const std::uint32_t> order, const RegionKindEnds& ends) noexcept;
  /// Answers what stands in these records.
  void record(PlaceRange range, const accel::TlasView& view, const HaltAt& halt,
              gpu::Recorder& recorder) noexcept;
  void unpack(PlaceRange range, const accel::TlasView& view, threads::ForkJoin& fork_join) noexcept;
  /// Places to be asked again: the i-th of them as the i-th record.
  std::span<const std::uint32_t> incomplete() const noexcept { return incomplete_; }
  std::uint32_t next_retry_batch() const noexcept {
    return static_cast<std::uint32_t>(incomplete_.size()) - settled_;
  }
  std::uint32_t min_retry_batch() const noexcept { return groups_at_once(processors_); }
  void record_again(PlaceRange range, const accel::TlasView& view, const HaltAt& halt,
                    gpu::Recorder& recorder) noexcept;
  void unpack_again(PlaceRange range, const accel::TlasView& view) noexcept;
  bool truncated() const noexcept;
  // As PreparedQuery.
  std::uint32_t answered() const noexcept { return answered_; }
  std::uint32_t incomplete(std::uint32_t answered) const noexcept;
  bool has_retries() const noexcept { return settled_ < incomplete_.size(); }
  void publish_answers(std::uint32_t answered, std::uint32_t count) noexcept;
  void discard_answers() noexcept { places_.discard_answers(); }
  std::span<const RegionAnswer> answers() const noexcept {
    return {answers_[places_.read()].of_regions.data(), places_.readable()};
  }

 private:
  struct Kernel {
    gpu::Pipeline pipeline;
    std::vector<gpu::Bindings> bindings;  // one per slot
  };
  /// What asks one kind.
  struct Kernels {
    std::optional<Kernel> still;   // where all ask at one instant; regions by triangle have none
    std::optional<Kernel> moving;  // everywhere
    std::optional<Kernel> lowest;  // asks those again that found more than they have room for
  };
  struct Answers {
    std::vector<EntityId> entities;         // ids_per_region for each at most, or
    std::vector<EntityTriangle> triangles;  // these, place after place
    std::vector<RegionAnswer> of_regions;   // looking into them
  };
  /// What a thread needs to put answers in order.
  struct Sorter {
    IdOrder id_order;
    std::vector<std::uint64_t> by_entity;  // and triangle, of one region
    std::vector<std::uint32_t> numbers;    // of one region, where all are of one entity
  };
  Result<void> create_kernels(gpu::Device& device);
  template <class Each>
  void each_kernel(Each each);
  Result<void> create_buffers(gpu::Device& device);
  bool lists_triangles() const noexcept { return options_.level == RegionLevel::triangle; }
  void make_room_for_answers();
  void dispatch(PlaceRange range, const RegionKindEnds& ends, bool alone, const accel::TlasView& view,
                const HaltAt& halt, gpu::Recorder& recorder) noexcept;
  std::uint32_t kept(const shared::RegionCount& count) const noexcept {
    return std::min(count.found, options_.ids_per_region);
  }
  bool overflows(const shared::RegionCount& count) const noexcept {
    return options_.ids_per_region > 0 && count.found > options_.ids_per_region;
  }
  /// Where the answers to these places begin, and which of them are incomplete. Returns how many ids there are.
  std::size_t lay_out(PlaceRange range) noexcept;
  /// The answer to `order_[place]` from what the device left at `from`.
  void unpack_answer(std::uint32_t place, std::uint32_t from, const accel::TlasView& view,
                     Sorter& sorter) noexcept;
  std::span<const EntityId> unpack_entities(std::size_t begin, std::uint32_t from, std::uint32_t kept,
                                            const accel::TlasView& view, Sorter& sorter) noexcept;
  std::span<const EntityTriangle> unpack_triangles(std::size_t begin, std::uint32_t from, std::uint32_t kept,
                                                   const accel::TlasView& view, Sorter& sorter) noexcept;

  RegionRunnerOptions options_;
  std::uint32_t answered_ = 0;
  std::uint32_t processors_ = 0;  // see DeviceLimits
  std::array<Kernels, region_kinds> kernels_;
  gpu::Buffer records_, counts_, ids_;
  std::span<const std::uint32_t> order_;  // the caller's region of each record
  RegionKindEnds ends_{};
  AnswerPlaces places_;
  std::vector<Answers> answers_;           // in each place
  std::vector<std::size_t> begins_;        // of the answers to each place of a batch, and to the one behind
  std::vector<Sorter> sorters_;            // one a thread
  std::vector<std::uint32_t> incomplete_;  // places to be asked again; has room for all
  std::uint32_t settled_ = 0;              // of them, those that have been asked again
  bool some_overflow_ = false;             // of those answered at once
};

}  // namespace rtstdb::query
