// Eight threads commit, read and wait at the same time, while the log is written, rotated and checkpointed.

#include <thread>

#include "logged_engine.hpp"

namespace rtstdb::transaction::test {
namespace {

class ConcurrentCommits : public testing::TestWithParam<DurabilityMode> {};

INSTANTIATE_TEST_SUITE_P(Durability, ConcurrentCommits, every_mode(), mode_name);

TEST_P(ConcurrentCommits, OfEightThreadsAreRecovered) {
  LoggedEngineOptions options;
  options.mode = GetParam();
  options.segment_bytes = 16384;
  options.checkpoint_every_bytes = 10'000;
  options.retained_changes = 16;  // checkpoints lose their version
  SimulatedDisk disk(1);
  constexpr std::uint32_t threads = 8;
  std::vector<EntityId> ids(threads);
  std::vector<std::uint32_t> last(threads);
  {
    LoggedEngine db(disk, options);
    for (EntityId& id : ids) {
      const auto transaction = db.make();
      transaction->begin({});
      transaction->create(body(0));
      ASSERT_TRUE(db.execute(*transaction).done());
      id = transaction->created(0);
    }
    std::vector<std::thread> clients;
    for (std::uint32_t client = 0; client < threads; ++client)
      clients.emplace_back([&, client] {
        const auto transaction = db.make();
        for (std::uint32_t k = 1; k <= 400 / one_in; ++k) {
          transaction->begin({});
          transaction->update(ids[client], body(k));
          const Outcome& outcome = db.execute(*transaction);
          if (!outcome.done()) continue;
          last[client] = k;
          EXPECT_LE(outcome.durable ? outcome.version : 0, db.log().durable());
          if (k % 50 == client) db.log().wait_until_durable(outcome.version, event_limit);
          if (k % 10 == 0) static_cast<void>(db.log().state());
        }
      });
    for (std::thread& client : clients)
      client.join();
    EXPECT_GE(db.log().state().checkpoints, one_in == 1 ? 1u : 0u);
    db.engine.close();
    EXPECT_TRUE(db.log().close().ok());
  }
  LoggedEngine db(disk, options);
  const Image image = db.image();
  for (std::uint32_t client = 0; client < threads; ++client)
    EXPECT_EQ(image[client].mask, last[client]);
}

}  // namespace
}  // namespace rtstdb::transaction::test
