// A closed database continues with the same world, in every mode.

#include "life.hpp"

namespace rtstdb::transaction::test {
namespace {

class EveryMode : public testing::TestWithParam<DurabilityMode> {
 protected:
  LifeOptions options() const {
    LifeOptions options;
    options.mode = GetParam();
    return options;
  }
  bool promises() const { return GetParam() != DurabilityMode::async; }

  SimulatedDisk disk_{1};
  std::mt19937_64 random_{1};
  Model model_;
};

INSTANTIATE_TEST_SUITE_P(Durability, EveryMode, every_mode(), mode_name);

TEST_P(EveryMode, ContinuesAfterClose) {
  Version version = 0;
  for (int lives = 0; lives < 4; ++lives) {
    Life life(disk_, options());
    const Recovery& recovery = life.log().recovery();
    EXPECT_EQ(recovery.found, lives > 0);
    EXPECT_EQ(recovery.version, version) << recovery.summary;
    EXPECT_EQ(recovery.closed, lives > 0) << recovery.summary;
    EXPECT_EQ(life.engine.latest().version, version);
    EXPECT_EQ(describe(life.image()), describe(living(model_.now())));
    for (int k = 0; k < 300 / one_in; ++k) {
      const Outcome& outcome = life.commit(model_, random_);
      ASSERT_TRUE(outcome.done()) << describe(outcome);
      EXPECT_EQ(outcome.durable, promises());
      if (promises()) {
        EXPECT_GE(life.log().durable(), outcome.version);
        EXPECT_GE(outcome.durable_at, outcome.published);
      }
    }
    version = life.engine.latest().version;
    life.engine.close();
    EXPECT_TRUE(life.log().close().ok());
    EXPECT_EQ(life.log().durable(), version);
    EXPECT_GE(life.log().state().checkpoints, one_in == 1 && promises() ? 1u : 0u);
  }
}

TEST_P(EveryMode, WaitsForTheDisk) {
  Life life(disk_, options());
  EXPECT_TRUE(life.log().wait_until_durable(0, Nanoseconds(0)));
  const Version version = life.commit(model_, random_).version;
  EXPECT_TRUE(life.log().wait_until_durable(version, long_time));
  EXPECT_GE(life.log().durable(), version);
  EXPECT_FALSE(life.log().wait_until_durable(version + 1, Nanoseconds(2'000'000)));
}

TEST_P(EveryMode, DoesNotRecordFailedTransactions) {
  {
    Life life(disk_, options());
    ASSERT_TRUE(life.commit(model_, random_).done());
    const auto transaction = life.make();
    transaction->begin({});
    transaction->create(body(77));
    transaction->remove({20, 1});
    EXPECT_EQ(life.execute(*transaction).status, Status::bad_input);
    transaction->begin({});
    transaction->expect_exists({20, 1});
    transaction->create(body(78));
    EXPECT_EQ(life.execute(*transaction).status, Status::conflict);
    // Firm, and late at the clock reading after its publication.
    transaction->begin(terms(DeadlineClass::firm, life.clock.peek() + Nanoseconds(1000)));
    transaction->create(body(79));
    life.executor.work = [&](const auto&, const auto&, const auto&) {
      life.clock.advance(Nanoseconds(2000));
      return query::RunReport{};
    };
    SimulatedQuery query(1);
    transaction->add_query(query, 1);
    EXPECT_EQ(life.execute(*transaction).status, Status::missed);
    EXPECT_FALSE(transaction->outcome().in_doubt);
    EXPECT_FALSE(transaction->outcome().durable);
  }
  Life life(disk_, options());
  EXPECT_EQ(describe(life.image()), describe(living(model_.now())));
  ASSERT_TRUE(life.commit(model_, random_).done());
}

TEST_P(EveryMode, EndsEveryTransactionWhenItCloses) {
  std::vector<std::unique_ptr<Transaction>> transactions;
  Life life(disk_, options());
  for (int k = 0; k < 50; ++k) {
    transactions.push_back(life.make());
    transactions.back()->begin({});
    transactions.back()->create(body(1));
    if (k % 8 == 7) transactions.back()->remove({static_cast<std::uint32_t>(k / 8), 1});
    life.engine.submit(*transactions.back());
  }
  life.engine.close();
  for (const auto& transaction : transactions) {
    ASSERT_NE(transaction->status(), Status::pending);
    if (transaction->outcome().done()) {
      EXPECT_EQ(transaction->outcome().durable, promises());
      EXPECT_LE(transaction->outcome().version, life.log().durable());
    }
  }
}

}  // namespace
}  // namespace rtstdb::transaction::test
