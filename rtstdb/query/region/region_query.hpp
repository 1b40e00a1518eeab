#pragma once
// The region query on the GPU.

#include <span>
#include <vector>

#include "rtstdb/query/point_order.hpp"
#include "rtstdb/query/region/region_search.hpp"

namespace rtstdb::query {

class GpuRegionQuery final : public RegionQuery, public RegionSearch {
 public:
  GpuRegionQuery(const RegionQueryOptions& options, const RegionSearchOptions& search);
  ~GpuRegionQuery() override { leave(); }

  std::span<Region> regions() noexcept override { return regions_; }
  std::span<const RegionAnswer> answers() const noexcept override { return published_answers(); }
  const AnswerInfo& answer_info() const noexcept override { return info; }

  CostClass cost_class() const noexcept override;
  std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                TimeSpan& times) const noexcept override;

 private:
  void order_batch(std::uint32_t count) noexcept override;
  void pack(std::span<const std::uint32_t> elements, std::span<shared::RegionRecord> records,
            const Recording& recording) const noexcept override;

  const RegionLevel level_;
  std::vector<Region> regions_;
  PointOrder point_order_;
};

}  // namespace rtstdb::query
