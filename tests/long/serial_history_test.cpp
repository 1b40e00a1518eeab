// Clients append and read in an engine whose queries read rows: one serial order explains their reads and
// agrees with real time.

#include <gtest/gtest.h>

#include <iostream>
#include <optional>
#include <span>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/transaction/engine.hpp"
#include "rtstdb/transaction/monotonic_clock.hpp"
#include "tests/long/list_clients.hpp"
#include "tests/support/rounds.hpp"

namespace hil::long_test {
namespace {

using namespace rtstdb;

constexpr int clients = 8;
constexpr int transactions_each = 60;

/// Reads whole lists.
class ListQuery final : public RayQuery, public query::PreparedQuery {
 public:
  struct List {
    Key key = 0;
    std::vector<EntityId> entities;
  };

  std::span<Ray> rays() noexcept override { return {}; }
  std::span<const RayHit> hits() const noexcept override { return {}; }
  query::CostClass cost_class() const noexcept override { return query::CostClass::ray_closest; }
  std::uint32_t capacity() const noexcept override { return 64; }
  std::optional<BadInput> check(std::uint32_t, const store::RowSource& rows,
                                store::TimeSpan& times) const noexcept override {
    times.first = std::min(times.first, rows.time());
    times.last = std::max(times.last, rows.time());
    return std::nullopt;
  }
  std::uint32_t answered() const noexcept override { return capacity(); }
  std::uint32_t incomplete(std::uint32_t) const noexcept override { return 0; }
  bool truncated() const noexcept override { return false; }
  void publish_answers(std::uint32_t, std::uint32_t) noexcept override {}
  void discard_answers() noexcept override {}
  const AnswerInfo& answer_info() const noexcept override { return info; }

  std::vector<List> lists;
};

class RowReader final : public ListReader {
 public:
  void add_to(Transaction& transaction, const std::vector<Key>& keys) override {
    query_.lists.clear();
    for (const Key key : keys)
      query_.lists.push_back({key, {}});
    transaction.add_query(query_, 1);
  }
  std::vector<EntityId> entities(std::size_t k) const override { return query_.lists[k].entities; }

 private:
  ListQuery query_;
};

std::vector<EntityId> list_in(const store::RowSource& rows, Key key) {
  std::vector<EntityId> entities;
  for (std::uint32_t index = 0; index < rows.index_limit(); ++index) {
    const EntityState* state = rows.row(index);
    if (state != nullptr && state->row.mask == value_mask && state->row.motion.p_world_m.x == list_x_m(key))
      entities.push_back(state->id);
  }
  return entities;
}

/// Reads half of the lists before it waits for its device and half after, as a device reads while other
/// transactions commit. The device is lost from time to time.
class ListExecutor final : public query::Executor {
 public:
  query::RunReport run(const store::RowSource& rows, std::span<const query::Request> requests,
                       const store::TimeSpan&, query::ExecutorCallbacks* callbacks) noexcept override {
    for (const bool second_half : {false, true}) {
      for (const query::Request& request : requests) {
        auto& lists = static_cast<ListQuery*>(request.query)->lists;
        for (std::size_t k = 0; k < lists.size(); ++k)
          if ((k >= lists.size() / 2) == second_half) lists[k].entities = list_in(rows, lists[k].key);
      }
      if (second_half || callbacks == nullptr) continue;
      callbacks->begin_wait();
      if (random_() % 4 == 0) std::this_thread::sleep_for(std::chrono::microseconds(20));  // a device's work
      callbacks->end_wait();
    }
    query::RunReport report;
    if (random_() % 64 == 0) report.status = query::RunStatus::device_lost;
    return report;
  }

 private:
  std::minstd_rand random_{1};
};

TEST(SerialHistory, OneSerialOrderExplainsAllReads) {
  const transaction::MonotonicClock clock;
  ListExecutor executor;
  transaction::Engine engine({.store = {.max_entities = 4096,
                                        .retained_changes = 1u << 14,
                                        .geometry_known = [](GeometryId id) { return !id.valid(); },
                                        .material_known = [](MaterialId id) { return id.index < materials; }},
                              .queue_capacity = 64},
                             executor, clock);
  ListClients<transaction::Engine> lists(engine, {.make_reader = [] { return std::make_unique<RowReader>(); },
                                                  .geometry = {},
                                                  .max_deadline = Nanoseconds(400'000)});
  const auto rounds = static_cast<std::uint32_t>(tests::rounds(210, 20'000));
  const HistorySummary summary = check_rounds(lists, rounds, clients, transactions_each);
  std::cout << summary.transactions << " transactions, " << summary.committed << " committed, "
            << summary.reads << " reads of lists\n";
  ASSERT_EQ(summary.anomaly, "");
  EXPECT_GT(summary.transactions, std::size_t{rounds} * clients * transactions_each * 9 / 10);
  EXPECT_GT(summary.committed, summary.transactions / 3);
  EXPECT_LT(summary.committed, summary.transactions * 19 / 20);
  EXPECT_GT(summary.reads, summary.transactions / 2);
}

}  // namespace
}  // namespace hil::long_test
