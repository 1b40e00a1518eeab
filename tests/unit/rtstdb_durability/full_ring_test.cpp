// A slow disk: async continues with a gap; group and sync refuse writes when the ring is full. Afterwards
// everything is complete.

#include "logged_engine.hpp"

namespace rtstdb::transaction::test {
namespace {

class FullRing : public testing::Test {
 protected:
  LoggedEngineOptions options(DurabilityMode mode) const {
    LoggedEngineOptions options;
    options.mode = mode;
    options.ring_bytes = 4096;
    options.checkpoint_every_bytes = 0;
    return options;
  }
  SimulatedDisk disk_{5};
  std::mt19937_64 random_{5};
  Model model_;
};

TEST_F(FullRing, AsyncContinuesAndIsCompleteAfterTheGap) {
  Version gap_begins_after = 0;
  {
    LoggedEngine db(disk_, options(DurabilityMode::async));
    DiskGate gate(disk_, DiskCall::sync);
    ASSERT_TRUE(db.commit(model_, random_).done());
    gate.wait_until_held();
    for (int k = 0; k < 500; ++k)
      ASSERT_TRUE(db.commit(model_, random_).done());
    Durability state = db.log().state();
    EXPECT_GT(state.commits_in_gaps, 300u);
    EXPECT_GT(state.ring_high_water, 3500u);
    EXPECT_EQ(state.ring_bytes, 4096u);
    EXPECT_EQ(state.durable, 0u);
    // A crash now would leave a state before the gap.
    SimulatedDisk crashed(1);
    crashed.set_contents(disk_.contents());
    const auto recovered = log::recover(crashed);
    ASSERT_TRUE(recovered.ok());
    EXPECT_TRUE(model_.knows(recovered.value().world.latest.version));
    gap_begins_after = recovered.value().world.latest.version;
    gate.open();
    EXPECT_TRUE(db.log().wait_until_durable(db.engine.latest().version, event_limit))
        << db.log().state().last_fault;
    state = db.log().state();
    EXPECT_EQ(state.gaps, 1u);
    EXPECT_GE(state.checkpoints, 1u);
    EXPECT_FALSE(state.waits_for_checkpoint);
    ASSERT_TRUE(db.commit(model_, random_).done());
    db.engine.close();
    EXPECT_TRUE(db.log().close().ok());
  }
  LoggedEngine db(disk_, options(DurabilityMode::async));
  EXPECT_GT(db.log().recovery().checkpoint, gap_begins_after);
  EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())));
}

TEST_F(FullRing, AsyncIsCompleteWhenClosedWithinAGap) {
  {
    LoggedEngine db(disk_, options(DurabilityMode::async));
    DiskGate gate(disk_, DiskCall::sync);
    ASSERT_TRUE(db.commit(model_, random_).done());
    gate.wait_until_held();
    for (int k = 0; k < 100; ++k)
      ASSERT_TRUE(db.commit(model_, random_).done());
    EXPECT_GT(db.log().state().commits_in_gaps, 0u);
    gate.open();
    db.engine.close();
    EXPECT_TRUE(db.log().close().ok());
    EXPECT_EQ(db.log().durable(), db.engine.latest().version);
  }
  LoggedEngine db(disk_, options(DurabilityMode::async));
  EXPECT_TRUE(db.log().recovery().closed) << db.log().recovery().summary;
  EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())));
}

TEST_F(FullRing, GroupRefusesAndLosesNoDurableVersion) {
  {
    LoggedEngine db(disk_, options(DurabilityMode::group));
    const auto creator = db.make();
    creator->begin({});
    creator->create(body(1));
    ASSERT_TRUE(db.execute(*creator).done());
    const EntityId id = creator->created(0);
    DiskGate gate(disk_, DiskCall::sync);
    std::vector<std::unique_ptr<Transaction>> held;
    bool refused = false;
    for (std::uint32_t k = 0; k < 200 && !refused; ++k) {
      held.push_back(db.make());
      held.back()->begin({});
      held.back()->update(id, body(100 + k));
      db.engine.submit(*held.back());
      if (k == 0) gate.wait_until_held();
      // A transaction that waits for the disk is already published.
      while (held.back()->status() == Status::pending && db.engine.latest().version < k + 2)
        std::this_thread::yield();
      if (held.back()->status() == Status::pending) continue;
      refused = true;
      EXPECT_EQ(held.back()->outcome().refused_by, RefusedBy::log_full);
      EXPECT_NE(describe(held.back()->outcome()).find("no space"), std::string::npos);
      // Reads are still executed.
      creator->begin({});
      creator->read(id);
      EXPECT_TRUE(db.execute(*creator).done());
      EXPECT_EQ(creator->state(0)->row.mask, 100 + k - 1);
    }
    EXPECT_TRUE(refused);
    held.pop_back();
    EXPECT_GT(held.size(), 3u);
    for (const auto& transaction : held)
      EXPECT_EQ(transaction->status(), Status::pending);
    gate.open();
    for (const auto& transaction : held) {
      EXPECT_TRUE(db.engine.wait(*transaction).durable);
      EXPECT_LE(transaction->outcome().version, db.log().durable());
    }
    EXPECT_EQ(db.log().state().commits_in_gaps, 0u);
    creator->begin({});
    creator->update(id, body(7));
    EXPECT_TRUE(db.execute(*creator).durable) << describe(creator->outcome());
  }
  disk_.crash();
  LoggedEngine db(disk_, options(DurabilityMode::group));
  EXPECT_EQ(db.image()[0].mask, 7u);
}

TEST_F(FullRing, SyncRefusesARecordLargerThanTheRing) {
  LoggedEngine db(disk_, options(DurabilityMode::sync));
  const auto large = db.engine.make_transaction(options_for(30, 0, 0));
  large->begin({});
  const std::uint32_t first = large->create(body(1));
  for (std::uint32_t k = 0; k < 29; ++k)
    large->update({first, 1}, body(k));
  EXPECT_EQ(db.execute(*large).refused_by, RefusedBy::log_full);
  ASSERT_TRUE(db.commit(model_, random_).durable);
}

}  // namespace
}  // namespace rtstdb::transaction::test
