#pragma once
// A database filled for a bench, and a prepared batch of rays that is queried repeatedly.

#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/transaction/spin.hpp"

namespace hil::bench {

class OurWorld {
 public:
  /// `spin`: see rtstdb/open_database.hpp.
  explicit OurWorld(const rtstdb::DatabaseOptions& options,
                    rtstdb::Nanoseconds spin = rtstdb::transaction::default_spin);
  /// Batches are not split into chunks.
  explicit OurWorld(std::uint32_t max_entities, std::uint32_t max_geometries = 16,
                    rtstdb::Nanoseconds spin = rtstdb::transaction::default_spin,
                    const rtstdb::DurabilityOptions& durability = {});

  rtstdb::Database& database() { return *database_; }
  rtstdb::GeometryId add(const rtstdb::TriangleMesh& mesh);
  /// Creates all in one version, valid from world time zero.
  std::vector<rtstdb::EntityId> create(std::span<const rtstdb::EntityRow> rows);

 private:
  std::unique_ptr<rtstdb::Database> database_;
};

/// One prepared query in a transaction of its own.
template <class Query>
class PreparedBatch {
 public:
  /// `expected`: of all runs.
  PreparedBatch(rtstdb::Database& database, std::unique_ptr<Query> query, std::uint32_t count,
                rtstdb::Status expected = rtstdb::Status::committed)
      : database_(database),
        query_(std::move(query)),
        transaction_(database.make_transaction({.max_queries = 1})),
        count_(count),
        expected_(expected) {}

  Query& query() { return *query_; }
  /// Returns the device's own time. Throws when the status is another one than is expected.
  double run() {
    transaction_->begin({});
    transaction_->add_query(*query_, count_);
    const rtstdb::Outcome& outcome = database_.execute(*transaction_);
    if (outcome.status != expected_) throw std::runtime_error(rtstdb::describe(outcome));
    return static_cast<double>(outcome.gpu_time.count()) * 1e-9;
  }

 private:
  rtstdb::Database& database_;
  std::unique_ptr<Query> query_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  std::uint32_t count_;
  rtstdb::Status expected_;
};

PreparedBatch<rtstdb::RayQuery> prepare_rays(OurWorld& world, std::span<const rtstdb::Ray> rays,
                                             rtstdb::RayMode mode);

/// Name and driver of the device.
std::string spatial_device();

}  // namespace hil::bench
