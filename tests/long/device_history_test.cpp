// Clients append and read in a database with a device: one serial order explains their reads and agrees with
// real time.

#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "tests/long/list_clients.hpp"
#include "tests/support/rounds.hpp"

namespace hil::long_test {
namespace {

using namespace rtstdb;

constexpr std::uint32_t max_values = 512;  // of one list
constexpr int clients = 4;
constexpr int transactions_each = 50;

/// Reads the lists by the regions around their places.
class RegionReader final : public ListReader {
 public:
  explicit RegionReader(Database& database) {
    auto made = database.prepare(
        RegionQueryOptions{.name = "lists", .capacity = list_count, .ids_per_region = max_values});
    if (!made) std::abort();
    query_ = std::move(made).value();
  }
  void add_to(Transaction& transaction, const std::vector<Key>& keys) override {
    for (std::size_t k = 0; k < keys.size(); ++k) {
      Region& region = query_->regions()[k];
      region = {};
      region.center_m.x = static_cast<float>(list_x_m(keys[k]));
      region.half_extent_m = {10.0f, 10.0f, 10.0f};
      region.mask = value_mask;
    }
    transaction.add_query(*query_, static_cast<std::uint32_t>(keys.size()));
  }
  std::vector<EntityId> entities(std::size_t k) const override {
    const RegionAnswer& answer = query_->answers()[k];
    if (answer.overflow || answer.incomplete) std::abort();  // the lists are too long for this test
    return {answer.entities.begin(), answer.entities.end()};
  }

 private:
  std::unique_ptr<RegionQuery> query_;
};

TEST(DeviceHistory, OneSerialOrderExplainsAllReads) {
  DatabaseOptions options;
  if (const char* select = std::getenv("HIL_TEST_GPU"); select != nullptr) options.gpu = select;
  options.validation = Validation::off;
  options.max_entities = 4096;
  options.retained_changes = 1u << 14;
  const auto database = Database::open(options);
  ASSERT_TRUE(database.ok()) << database.error().message;
  const auto geometry = database.value()->add_geometry(make_box({1.0, 1.0, 1.0}), "value");
  ASSERT_TRUE(geometry.ok()) << geometry.error().message;
  Database& opened = *database.value();
  for (std::uint32_t index = 1; index < materials; ++index)
    ASSERT_TRUE(opened.add_material({}, "value " + std::to_string(index)).ok());
  ListClients<Database> lists(opened, {.make_reader = [&] { return std::make_unique<RegionReader>(opened); },
                                       .geometry = geometry.value(),
                                       .max_deadline = Nanoseconds(20'000'000)});
  const auto rounds = static_cast<std::uint32_t>(tests::rounds(3, 100));
  const HistorySummary summary = check_rounds(lists, rounds, clients, transactions_each);
  std::cout << summary.transactions << " transactions, " << summary.committed << " committed, "
            << summary.reads << " reads of lists\n";
  EXPECT_EQ(summary.anomaly, "");
  EXPECT_GT(summary.committed, summary.transactions / 4);
  EXPECT_LT(summary.committed, summary.transactions);
  EXPECT_GT(summary.reads, summary.transactions / 4);
}

}  // namespace
}  // namespace hil::long_test
