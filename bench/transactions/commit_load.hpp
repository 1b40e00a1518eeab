#pragma once
// Commits of rows alone: entities are moved by transactions that are made beforehand, the same rows in the same order by every load
// of the same size.

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
  rtstdb::Nanoseconds spin = rtstdb::DatabaseOptions{}.spin;
  rtstdb::DurabilityOptions durability{};
};

/// Whatever does not commit throws std::runtime_error.
class CommitLoad {
 public:
  explicit CommitLoad(const CommitLoadOptions& options);

  /// Transactions a second: all of them submitted, then all waited for, so many times over.
  double rate(int times);
  /// The same once.
  void once();
  rtstdb::Database& database() { return world_->database(); }
  /// The database is closed, and what survived is opened.
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

/// Throws std::runtime_error, which says where, unless both stand at the same version with the same rows, bit for bit.
void demand_same_world(rtstdb::Database& a, rtstdb::Database& b);

}  // namespace hil::bench
