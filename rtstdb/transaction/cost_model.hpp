#pragma once
// What work costs, learned from what it cost: a line for each prepared query, seeded by that of its kind until it has
// samples of its own; for rows written and for positions of shapes; and for what brings a version to the device, by rows
// where the tree stays and by entities where it is built. One thread at a time; no allocation.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/store/write_set.hpp"
#include "rtstdb/transaction/cost_line.hpp"

namespace rtstdb::transaction {

struct Prediction {
  Nanoseconds mean{0};
  Nanoseconds promised{0};  ///< see cost_line.hpp
  Nanoseconds needed{0};    ///< of that, what remains where queries whose answers may be partial get none
};

class CostModel {
 public:
  /// Below this many samples of a kind nothing is predicted for it.
  static constexpr std::uint64_t samples_needed = 16;
  /// From this many on a prepared query is predicted by its own.
  static constexpr std::uint64_t own_samples_needed = 8;

  /// None while a kind that takes part has too few samples.
  std::optional<Prediction> predict(const store::WriteSet& writes,
                                    std::span<const query::Request> requests) const noexcept;
  /// The longest that can not be interrupted, as far as it was measured: structures brought up for a run, and the rows of a
  /// commit.
  struct Pieces {
    Nanoseconds structures{0}, commit{0};
  };
  Pieces longest_pieces() const noexcept;
  /// Half of what an urgent transaction may wait, or longer where chunks would be too small.
  static Nanoseconds chunk_time(Nanoseconds half) noexcept;
  /// Sets how requests are divided into chunks that take so long: not at all where all of them together take no more than two of these,
  /// also if their elements cost what the dearest did.
  void divide(std::span<query::Request> requests, Nanoseconds chunk) const noexcept;

  /// A transaction with those writes took so long, its queries not counted. Bringing a shape to the device is part of
  /// the queries that want it.
  void learn_writes(const store::WriteSet& writes, Nanoseconds cost) noexcept;
  /// One run of the executor. The cost is split in the proportion of the predictions; what has none yet takes what the
  /// others leave.
  void learn_queries(std::span<const query::Request> requests, Nanoseconds cost,
                     const query::StructureWork& structures = {}) noexcept;
  /// Before what the run as a whole cost is learnt, and also of one that came to nothing: how dear elements of it were.
  void learn_dearest(std::span<const query::Request> requests, Nanoseconds cost,
                     const query::StructureWork& structures) noexcept;
  /// A run that was given up, by what its queries had answered by then: what the whole of it would have cost, where that is
  /// clearly more than was predicted. A run that is not done says nothing of what is cheaper.
  void learn_stopped(std::span<const query::Request> requests, Nanoseconds cost,
                     const query::StructureWork& structures) noexcept;

 private:
  /// One line that takes part in a cost.
  struct Part {
    query::CostSamples* samples = nullptr;
    double count = 0.0;
  };
  static constexpr std::size_t max_structure_parts = 3;
  using StructureParts = std::array<Part, max_structure_parts>;  // a part without samples is none

  StructureParts parts_of(const query::StructureWork& structures) noexcept;
  /// What a transaction is likely to need.
  query::StructureWork expected(const store::WriteSet& writes,
                                std::span<const query::Request> requests) const noexcept;
  const query::CostSamples& of_kind(const query::Request& request) const noexcept {
    return kinds_[static_cast<std::size_t>(request.query->kind())];
  }
  const query::CostSamples& of(const query::Request& request) const noexcept {
    return request.query->cost.samples >= own_samples_needed ? request.query->cost : of_kind(request);
  }

  query::CostSamples writes_;
  query::CostSamples positions_;  // beside the rows of the same transaction
  query::CostSamples refits_, builds_, shapes_;
  double max_rows_ = 0.0, max_positions_ = 0.0;        // of one transaction
  double max_refitted_rows_ = 0.0, max_shapes_ = 0.0;  // for one run
  std::uint32_t entities_ = 0;                         // of the version that was asked last
  std::array<query::CostSamples, static_cast<std::size_t>(query::QueryKind::count)> kinds_;
};

}  // namespace rtstdb::transaction
