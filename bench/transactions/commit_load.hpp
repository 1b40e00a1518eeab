#pragma once
// Commits of rows only: prepared transactions move entities, with the same rows in the same order for every
// load of one size.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "bench/spatial/our_world.hpp"

namespace hil::bench {

struct CommitLoadOptions {
  std::uint32_t transactions = 1;  ///< that wait at once
  std::uint32_t rows = 1;          ///< in each
  bool turns = false;              ///< every number of a motion changes, rather than one
  rtstdb::Nanoseconds spin = rtstdb::transaction::default_spin;
  rtstdb::DurabilityOptions durability{};
};

/// Throws std::runtime_error if a transaction does not commit.
class CommitLoad {
 public:
  explicit CommitLoad(const CommitLoadOptions& options);

  /// Transactions per second: submits all of them and waits for all, `rounds` times.
  double rate(int times);
  /// The same once.
  void once();
  rtstdb::Database& database() { return world_->database(); }
  /// Closes the database and opens what was recovered.
  void reopen();

 private:
  void open();

  CommitLoadOptions options_;
  std::optional<OurWorld> world_;
  std::vector<rtstdb::EntityRow> states_;
  std::vector<rtstdb::EntityId> ids_;
  std::vector<std::unique_ptr<rtstdb::Transaction>> made_;
  std::size_t next_ = 0;
};

/// Throws std::runtime_error, with the place, unless both have the same version with the same rows, bit for
/// bit.
void demand_same_world(rtstdb::Database& a, rtstdb::Database& b);

}  // namespace hil::bench
