#pragma once
// A small world with queries of all kinds, fixed and deforming geometry, in a database whose device can be
// lost at any call, or in an undisturbed one to compare with.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <rtstdb/database.hpp>

#include "tests/gpu/fault_loader.hpp"
#include "tests/gpu/kind_cases.hpp"

namespace rtstdb::test {

/// Every bit of a query's answers.
using AnswerBits = std::vector<std::uint32_t>;

class DeviceLossWorld {
 public:
  enum class On : std::uint8_t {
    real_device,
    failing_device,  ///< behind the fault loader
    copying_device,  ///< does not import memory of the host
  };

  explicit DeviceLossWorld(On device, DatabaseOptions options = {});
  /// The steps of the setup, which run in order. A step returns the error of the database.
  static int setup_steps();
  /// The steps that prepare the queries of one kind each.
  static std::vector<int> query_steps();
  Result<void> set_up(int step);
  /// All steps; an error fails the test.
  void set_up();

  Database& database() { return *database_; }

  /// A kind of transaction, with queries, or with writes and queries. Its content follows from the round.
  struct TransactionCase {
    std::string name;
    std::function<void(Transaction&, unsigned round)> declare;
    std::function<void(AnswerBits&)> append_answers;
    bool writes = false;
  };
  const std::vector<TransactionCase>& kinds() const { return kinds_; }
  const Outcome& execute(const TransactionCase& kind, unsigned round);
  AnswerBits answers(const TransactionCase& kind) const;
  /// Transactions that write give this geometry to some entities.
  void show_as(GeometryId geometry) { newest_ = geometry; }
  std::vector<EntityState> rows() const;

 private:
  Result<void> add_geometries();
  Result<void> add_geometry_that_deforms();
  Result<void> prepare_queries(std::string_view kind);
  Result<void> create_entities();
  void add_writing_kinds();

  std::unique_ptr<Database> database_;
  std::vector<GeometryId> geometries_;
  GeometryId newest_;
  TriangleMesh deforming_mesh_;
  std::vector<EntityId> entities_;
  std::vector<EntityState> states_;  // as created
  std::vector<std::unique_ptr<KindCase>> queries_;
  std::vector<TransactionCase> kinds_;
  std::unique_ptr<Transaction> transaction_;
};

bool same(const EntityState& a, const EntityState& b);

}  // namespace rtstdb::test
