#pragma once
// The overlap query on the GPU: a region search in each entity's own oriented bounds, which the entity
// carries.

#include <span>
#include <vector>

#include "rtstdb/query/region/region_search.hpp"

namespace rtstdb::query {

class GpuOverlapQuery final : public OverlapQuery, public RegionSearch {
 public:
  explicit GpuOverlapQuery(const RegionSearchOptions& search)
      : RegionSearch(search), overlaps_(search.capacity) {}
  ~GpuOverlapQuery() override { leave(); }

  std::span<Overlap> overlaps() noexcept override { return overlaps_; }
  std::span<const OverlapAnswer> answers() const noexcept override { return published_answers(); }
  const AnswerInfo& answer_info() const noexcept override { return info; }

  CostClass cost_class() const noexcept override { return CostClass::overlap; }
  std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                TimeSpan& times) const noexcept override;

 private:
  void pack(std::span<const std::uint32_t> elements, std::span<shared::RegionRecord> records,
            const Recording& recording) const noexcept override;

  std::vector<Overlap> overlaps_;
};

}  // namespace rtstdb::query
