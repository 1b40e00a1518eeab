// Closing a database and opening it again, in every mode.

#include "logged_engine.hpp"

namespace rtstdb::transaction::test {
namespace {

class EveryMode : public testing::TestWithParam<DurabilityMode> {
 protected:
  LoggedEngineOptions options() const {
    LoggedEngineOptions options;
    options.mode = GetParam();
    return options;
  }
  bool durable_at_once() const { return GetParam() != DurabilityMode::async; }

  SimulatedDisk disk_{1};
  std::mt19937_64 random_{1};
  Model model_;
};

INSTANTIATE_TEST_SUITE_P(Durability, EveryMode, every_mode(), mode_name);

TEST_P(EveryMode, KeepsTheWorldOverClose) {
  Version version = 0;
  for (int round = 0; round < 4; ++round) {
    LoggedEngine db(disk_, options());
    const Recovery& recovery = db.log().recovery();
    EXPECT_EQ(recovery.found, round > 0);
    EXPECT_EQ(recovery.version, version) << recovery.summary;
    EXPECT_EQ(recovery.closed, round > 0) << recovery.summary;
    EXPECT_EQ(db.engine.latest().version, version);
    EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())));
    for (int k = 0; k < 300 / one_in; ++k) {
      const Outcome& outcome = db.commit(model_, random_);
      ASSERT_TRUE(outcome.done()) << describe(outcome);
      EXPECT_EQ(outcome.durable, durable_at_once());
      if (durable_at_once()) {
        EXPECT_GE(db.log().durable(), outcome.version);
        EXPECT_GE(outcome.durable_at, outcome.published);
      }
    }
    version = db.engine.latest().version;
    db.engine.close();
    EXPECT_TRUE(db.log().close().ok());
    EXPECT_EQ(db.log().durable(), version);
    EXPECT_GE(db.log().state().checkpoints, one_in == 1 && durable_at_once() ? 1u : 0u);
  }
}

TEST_P(EveryMode, WaitsUntilAVersionIsDurable) {
  LoggedEngine db(disk_, options());
  EXPECT_TRUE(db.log().wait_until_durable(0, Nanoseconds(0)));
  const Version version = db.commit(model_, random_).version;
  EXPECT_TRUE(db.log().wait_until_durable(version, event_limit));
  EXPECT_GE(db.log().durable(), version);
  EXPECT_FALSE(db.log().wait_until_durable(version + 1, Nanoseconds(2'000'000)));
}

TEST_P(EveryMode, DoesNotRecordFailedTransactions) {
  {
    LoggedEngine db(disk_, options());
    ASSERT_TRUE(db.commit(model_, random_).done());
    const auto transaction = db.make();
    transaction->begin({});
    transaction->create(body(77));
    transaction->remove({20, 1});
    EXPECT_EQ(db.execute(*transaction).status, Status::bad_input);
    transaction->begin({});
    transaction->expect_exists({20, 1});
    transaction->create(body(78));
    EXPECT_EQ(db.execute(*transaction).status, Status::conflict);
    // Firm, and late at the clock reading after its publication.
    transaction->begin(terms(DeadlineClass::firm, db.clock.peek() + Nanoseconds(1000)));
    transaction->create(body(79));
    db.executor.work = [&](const auto&, const auto&, const auto&) {
      db.clock.advance(Nanoseconds(2000));
      return query::RunReport{};
    };
    SimulatedQuery query(1);
    transaction->add_query(query, 1);
    EXPECT_EQ(db.execute(*transaction).status, Status::missed);
    EXPECT_FALSE(transaction->outcome().in_doubt);
    EXPECT_FALSE(transaction->outcome().durable);
  }
  LoggedEngine db(disk_, options());
  EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())));
  ASSERT_TRUE(db.commit(model_, random_).done());
}

TEST_P(EveryMode, EndsEveryTransactionAtClose) {
  std::vector<std::unique_ptr<Transaction>> transactions;
  LoggedEngine db(disk_, options());
  for (int k = 0; k < 50; ++k) {
    transactions.push_back(db.make());
    transactions.back()->begin({});
    transactions.back()->create(body(1));
    if (k % 8 == 7) transactions.back()->remove({static_cast<std::uint32_t>(k / 8), 1});
    db.engine.submit(*transactions.back());
  }
  db.engine.close();
  for (const auto& transaction : transactions) {
    ASSERT_NE(transaction->status(), Status::pending);
    if (transaction->outcome().done()) {
      EXPECT_EQ(transaction->outcome().durable, durable_at_once());
      EXPECT_LE(transaction->outcome().version, db.log().durable());
    }
  }
}

}  // namespace
}  // namespace rtstdb::transaction::test
