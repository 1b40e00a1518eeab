#pragma once
// A small world with every kind of query, geometry that stays and geometry that deforms, in a database whose
// device can be lost at any call; and the same in one that is left alone, to compare with.

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

class LossWorld {
 public:
  enum class On : std::uint8_t {
    real_device,
    failing_device,  ///< by the failing loader
    copying_device,  ///< one that can not take memory of the host in
  };

  explicit LossWorld(On device, DatabaseOptions options = {});
  /// In the order that the world needs; each fails where the database says so.
  static int setup_steps();
  /// Of them, those that prepare the queries of one kind.
  static std::vector<int> query_steps();
  Result<void> set_up(int step);
  /// All of them; fails the test where one does.
  void set_up();

  Database& database() { return *database_; }

  /// One kind of transaction: asks, or writes and asks. Each round another one.
  struct Kind {
    std::string name;
    std::function<void(Transaction&, unsigned round)> declare;
    std::function<void(AnswerBits&)> append_answers;
    bool writes = false;
  };
  const std::vector<Kind>& kinds() const { return kinds_; }
  const Outcome& execute(const Kind& kind, unsigned round);
  AnswerBits answers(const Kind& kind) const;
  /// Some of the entities get that geometry with the next transaction that writes.
  void show_as(GeometryId geometry) { newest_ = geometry; }
  /// All rows, as they are compared.
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
  TriangleMesh skin_;  // of the one that deforms
  std::vector<EntityId> entities_;
  std::vector<EntityState> states_;  // as they were created
  std::vector<std::unique_ptr<KindCase>> queries_;
  std::vector<Kind> kinds_;
  std::unique_ptr<Transaction> transaction_;
};

bool same(const EntityState& a, const EntityState& b);

}  // namespace rtstdb::test
