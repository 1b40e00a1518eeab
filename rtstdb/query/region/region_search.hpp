#pragma once
// The search for what lies in regions, with its kernels and its lists of answers. Region and overlap queries
// are two ways to say which region each element means.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rtstdb/query/gpu_query.hpp"
#include "rtstdb/query/region/id_order.hpp"
#include "shaders/shared/query.h"

namespace rtstdb::query {

/// One kernel searches the regions of one shape group: those of one shape, but that boxes and spheres are one
/// group at RegionLevel::bounds.
inline constexpr std::size_t shape_groups = 3;
constexpr std::size_t shape_group(RegionLevel level, RegionShape shape) noexcept {
  return level == RegionLevel::bounds && shape == RegionShape::sphere ? 0 : static_cast<std::size_t>(shape);
}
/// Where each shape group ends in a batch that has one group after the other.
using ShapeGroupEnds = std::array<std::uint32_t, shape_groups>;

struct RegionSearchOptions {
  std::string name;
  std::uint32_t capacity = 0;
  RegionLevel level = RegionLevel::bounds;
  std::uint32_t ids_per_region = 0;  ///< 0: counts alone
  bool frusta = false;               ///< elements may be frusta
  LatePolicy late = LatePolicy::discard;
};

/// Errors: capacity; bad_input for an unknown level.
Result<void> check_region_search_options(const RegionSearchOptions& options);

class RegionSearch : public GpuQuery {
 public:
  void record(const BatchPart& part, const Recording& recording) noexcept final;
  /// Allocates what the caller reads. After the first move_to, which refuses what the device can not hold.
  void allocate_host_memory();

 protected:
  /// The options have passed check_region_search_options.
  explicit RegionSearch(const RegionSearchOptions& options);

  /// Packs elements, by their numbers, into as many records.
  virtual void pack(std::span<const std::uint32_t> elements, std::span<shared::RegionRecord> records,
                    const Recording& recording) const noexcept = 0;
  /// Puts the elements in order, one shape group after the other. Default: as they are, all of the first
  /// group.
  void order_batch(std::uint32_t count) noexcept override;
  /// What order_batch writes: the element at each place, and the groups' ends.
  std::span<std::uint32_t> order() noexcept { return order_; }
  void set_ends(const ShapeGroupEnds& ends) noexcept { ends_ = ends; }

  std::span<const RegionAnswer> published_answers() const noexcept {
    return {answers_[slots().read()].of_regions.data(), slots().readable()};
  }

 private:
  /// The kernels of one shape group, as indices for kernel().
  struct GroupKernels {
    std::optional<std::size_t> one_instant;  // all regions have one instant; regions by triangle have none
    std::optional<std::size_t> moving;       // any regions
    std::optional<std::size_t> lowest;       // finds the lowest ids of regions that found more than fit
  };
  struct Answers {
    std::vector<EntityId> entities;         // ids_per_region for each region at most, or
    std::vector<EntityTriangle> triangles;  // these, in the order of places
    std::vector<RegionAnswer> of_regions;   // refer to them
  };
  /// What one thread needs to sort answers.
  struct Sorter {
    IdOrder id_order;
    std::vector<std::uint64_t> by_entity;  // entity and triangle, of one region
    std::vector<std::uint32_t> numbers;    // triangles of one region, where all are of one entity
  };

  DeviceNeeds device_needs(const gpu::DeviceLimits& limits) final;
  std::vector<const gpu::Buffer*> bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                const accel::GeometryPool& pool,
                                                const accel::Tlas& tlas) const final;
  void unpack(const BatchPart& part, const accel::TlasView& view) noexcept final;
  bool is_incomplete(std::uint32_t place) const noexcept final {
    return answers_[slots().written()].of_regions[order_[place]].incomplete;
  }
  void mark_incomplete(std::uint32_t place) noexcept final;

  bool lists_triangles() const noexcept { return options_.level == RegionLevel::triangle; }
  std::uint32_t listed(const shared::RegionCount& count) const noexcept {
    return std::min(count.found, options_.ids_per_region);
  }
  bool overflows(const shared::RegionCount& count) const noexcept {
    return options_.ids_per_region > 0 && count.found > options_.ids_per_region;
  }
  /// Decides where the answers of these places begin, and notes what is incomplete. Returns the number of
  /// ids.
  std::size_t lay_out(PlaceRange range) noexcept;
  /// Writes the answer at a place from the record that the device left.
  void unpack_answer(std::uint32_t place, std::uint32_t record, const accel::TlasView& view,
                     Sorter& sorter) noexcept;
  std::span<const EntityId> unpack_entities(std::size_t begin, std::uint32_t record, std::uint32_t listed,
                                            const accel::TlasView& view, Sorter& sorter) noexcept;
  std::span<const EntityTriangle> unpack_triangles(std::size_t begin, std::uint32_t record,
                                                   std::uint32_t listed, const accel::TlasView& view,
                                                   Sorter& sorter) noexcept;

  const RegionSearchOptions options_;
  std::array<GroupKernels, shape_groups> kernels_;
  gpu::Buffer records_, counts_, ids_;
  std::vector<std::uint32_t> order_;  // the element at each place
  ShapeGroupEnds ends_{};
  std::vector<Answers> answers_;     // one per answer slot
  std::vector<std::size_t> begins_;  // of the answers at each place of a batch, and of the one behind
  std::vector<Sorter> sorters_;      // one per thread
};

}  // namespace rtstdb::query
