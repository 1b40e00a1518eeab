#pragma once
// What the cost model knows of each prepared query, by the query's id. The capacity is fixed, so that the
// tick allocates nothing: a set-associative table in which a new query replaces the one of its set that ran
// longest ago. As ids count up, the last `capacity` prepared queries always fit.
//
// Threads: one at a time.

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "rtstdb/scheduler/cost_line.hpp"

namespace rtstdb::scheduler {

struct QueryCosts {
  CostLine line;
  double structures_share = 0.0;  ///< of the last runs, those that had to bring structures to the device
  double last_share_ns = 0.0;     ///< of the cost of the last run that updated the estimate
};

class QueryCostTable {
 public:
  static constexpr std::size_t capacity = 1024;

  QueryCostTable() : entries_(capacity) {}

  /// What is known of the query; null: nothing.
  const QueryCosts* find(std::uint64_t id) const noexcept {
    const Entry* const set = &entries_[set_of(id)];
    for (std::size_t k = 0; k < ways; ++k)
      if (set[k].id == id) return &set[k].costs;
    return nullptr;
  }
  QueryCosts* find(std::uint64_t id) noexcept {
    return const_cast<QueryCosts*>(std::as_const(*this).find(id));
  }

  /// The entry of the query, a new one where there is none. `id` is not 0.
  QueryCosts& use(std::uint64_t id) noexcept {
    Entry* const set = &entries_[set_of(id)];
    Entry* oldest = set;
    ++uses_;
    for (std::size_t k = 0; k < ways; ++k) {
      if (set[k].id == id) {
        set[k].used = uses_;
        return set[k].costs;
      }
      if (set[k].used < oldest->used) oldest = &set[k];
    }
    *oldest = {.id = id, .used = uses_, .costs = {}};
    return oldest->costs;
  }

 private:
  static constexpr std::size_t ways = 8;
  struct Entry {
    std::uint64_t id = 0;  ///< 0: free
    std::uint64_t used = 0;
    QueryCosts costs;
  };
  static std::size_t set_of(std::uint64_t id) noexcept { return id % (capacity / ways) * ways; }

  std::vector<Entry> entries_;
  std::uint64_t uses_ = 0;
};

}  // namespace rtstdb::scheduler
