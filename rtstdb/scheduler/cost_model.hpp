#pragma once
// Predicts what a transaction costs from what earlier ones took: a line (CostLine) for each cost class and
// for each prepared query; one for rows written and one for positions of shapes; and lines for bringing a
// version's structures to the device, by rows where the tree is refitted and by entities where it is built.
//
// Threads: one at a time. Allocates in the constructor alone.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/scheduler/cost_line.hpp"
#include "rtstdb/scheduler/query_cost_table.hpp"
#include "rtstdb/store/write_set.hpp"

namespace rtstdb::scheduler {

struct Prediction {
  Nanoseconds mean{0};
  Nanoseconds promised{0};  ///< the mean and a safety margin (CostLine::promised_ns)
  Nanoseconds required{0};  ///< of `promised`, what is left without the queries whose answers may be partial
};

class CostModel {
 public:
  /// With fewer samples than this of a kind of work nothing is predicted that contains it.
  static constexpr std::uint64_t min_samples = 16;
  /// With fewer samples than this of a prepared query the line of its cost class predicts it.
  static constexpr std::uint64_t min_query_samples = 8;

  /// The cost of a transaction with these writes and requests. None: a kind of work in it has fewer than
  /// min_samples.
  std::optional<Prediction> predict(const store::WriteSet& writes,
                                    std::span<const query::Request> requests) const noexcept;

  /// The longest pieces of work seen that can not be preempted.
  struct Pieces {
    Nanoseconds structures{0};  ///< structures brought to the device for a run
    Nanoseconds commit{0};      ///< the writes of one transaction
  };
  Pieces longest_pieces() const noexcept;

  /// The time that a chunk should take: `half` (half of what a higher-priority transaction may wait), or
  /// longer where the dispatch itself would be most of it.
  static Nanoseconds chunk_time(Nanoseconds half) noexcept;
  /// Sets per_chunk, initial_chunk_fraction and chunk_time of each request for chunks that take
  /// chunk_time(half). The requests are not divided where all together take no more than two chunks, even if
  /// each element costs what the most expensive one did.
  void divide(std::span<query::Request> requests, Nanoseconds half) const noexcept;

  /// A transaction with these writes took `cost`, its queries excluded. The time to bring a shape to the
  /// device counts with the queries that need it.
  void update_from_writes(const store::WriteSet& writes, Nanoseconds cost) noexcept;
  /// One run of the executor took `cost`. It is split in proportion to the predictions; parts without samples
  /// get what the others leave.
  void update_from_queries(std::span<const query::Request> requests, Nanoseconds cost,
                           const query::StructureWork& structures = {}) noexcept;
  /// Updates the estimate of the worst cost of single elements from a run. To be called before
  /// update_from_queries, and also for a run that was stopped.
  void update_from_worst_elements(std::span<const query::Request> requests, Nanoseconds cost,
                                  const query::StructureWork& structures) noexcept;
  /// Updates the estimate from a run that was stopped after `cost`, scaled to the whole run by what it had
  /// answered, where that is clearly more than predicted, or where there are fewer than min_samples and it
  /// had answered some. An incomplete run can not show that work has become cheaper.
  void update_from_stopped(std::span<const query::Request> requests, Nanoseconds cost,
                           const query::StructureWork& structures) noexcept;

 private:
  /// One line that takes part in the cost of a run.
  struct Part {
    CostLine* line = nullptr;  ///< null: no part
    double count = 0.0;
  };
  static constexpr std::size_t max_structure_parts = 3;
  using StructureParts = std::array<Part, max_structure_parts>;

  StructureParts parts_of(const query::StructureWork& structures) noexcept;
  /// The structure work that a transaction is likely to cause.
  query::StructureWork expected(const store::WriteSet& writes,
                                std::span<const query::Request> requests) const noexcept;
  CostLine& class_line(const query::Request& request) noexcept {
    return class_lines_[static_cast<std::size_t>(request.query->cost_class())];
  }
  const CostLine& class_line(const query::Request& request) const noexcept {
    return class_lines_[static_cast<std::size_t>(request.query->cost_class())];
  }
  bool has_own_line(const query::Request& request) const noexcept;
  /// The line that predicts the request: the query's own, or its cost class's.
  const CostLine& line_of(const query::Request& request) const noexcept;

  CostLine writes_;
  CostLine positions_;  ///< beyond the cost of the rows of the same transaction
  CostLine refits_, builds_, shapes_;
  double max_rows_ = 0.0, max_positions_ = 0.0;        ///< of one transaction
  double max_refitted_rows_ = 0.0, max_shapes_ = 0.0;  ///< of one run
  std::uint32_t entities_ = 0;                         ///< of the version that was queried last
  std::array<CostLine, static_cast<std::size_t>(query::CostClass::count)> class_lines_;
  QueryCostTable queries_;
};

}  // namespace rtstdb::scheduler
