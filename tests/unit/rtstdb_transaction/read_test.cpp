// Rows that a transaction reads with Transaction::read.

#include <gtest/gtest.h>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

class Reads : public testing::Test {
 protected:
  World world_;
  EntityId first_ = world_.create(10);
  EntityId second_ = world_.create(20);
};

TEST_F(Reads, ReturnTheLatestRows) {
  const auto transaction = world_.make();
  transaction->begin({});
  EXPECT_EQ(transaction->read(second_), 0u);
  EXPECT_EQ(transaction->read(first_), 1u);
  EXPECT_EQ(transaction->read(second_), 2u) << "the same entity twice is allowed";
  ASSERT_EQ(world_.execute(*transaction).status, Status::committed);
  ASSERT_NE(transaction->state(0), nullptr);
  EXPECT_EQ(transaction->state(0)->id, second_);
  EXPECT_EQ(transaction->state(0)->row.mask, 20u);
  EXPECT_EQ(transaction->state(0)->written_by, 2u);
  EXPECT_EQ(transaction->state(1)->row.mask, 10u);
  EXPECT_EQ(transaction->state(1)->written_by, 1u);
  EXPECT_EQ(transaction->state(2)->id, second_);
}

TEST_F(Reads, IncludeTheWritesOfTheirTransaction) {
  const auto transaction = world_.make();
  transaction->begin({});
  const auto of_removed = transaction->read(first_);
  transaction->update(second_, row_of(21));
  transaction->remove(first_);
  const auto of_updated = transaction->read(second_);
  transaction->create(row_of(30));
  const auto of_created = transaction->read({first_.index, first_.generation + 1});
  ASSERT_EQ(world_.execute(*transaction).status, Status::committed);
  EXPECT_EQ(transaction->state(of_removed), nullptr)
      << "reads follow all writes, in whichever order they are declared";
  ASSERT_NE(transaction->state(of_updated), nullptr);
  EXPECT_EQ(transaction->state(of_updated)->row.mask, 21u);
  EXPECT_EQ(transaction->state(of_updated)->written_by, transaction->outcome().version);
  ASSERT_NE(transaction->state(of_created), nullptr);
  EXPECT_EQ(transaction->state(of_created)->row.mask, 30u);
}

TEST_F(Reads, AreOfThePinnedVersion) {
  const auto writer = world_.make();
  writer->begin({});
  writer->update(first_, row_of(11));
  ASSERT_EQ(world_.execute(*writer).status, Status::committed);
  Terms pinned;
  pinned.read_at = ReadAt::pinned(1);
  const auto transaction = world_.make();
  transaction->begin(pinned);
  const auto of_first = transaction->read(first_);
  const auto of_second = transaction->read(second_);
  ASSERT_EQ(world_.execute(*transaction).status, Status::committed);
  ASSERT_NE(transaction->state(of_first), nullptr);
  EXPECT_EQ(transaction->state(of_first)->row.mask, 10u);
  EXPECT_EQ(transaction->state(of_second), nullptr) << "created by a later version";
}

TEST_F(Reads, AreNotChangedByLaterWrites) {
  const auto transaction = world_.make();
  transaction->begin({});
  transaction->read(first_);
  world_.execute(*transaction);
  const EntityState* state = transaction->state(0);
  const auto writer = world_.make();
  writer->begin({});
  writer->update(first_, row_of(99));
  world_.execute(*writer);
  EXPECT_EQ(state->row.mask, 10u);
  EXPECT_EQ(transaction->state(0), state);
}

TEST_F(Reads, OfUnknownEntitiesReturnNothing) {
  const auto transaction = world_.make();
  transaction->begin({});
  transaction->read({first_.index, first_.generation + 1});
  transaction->read({4'000'000'000u, 1});
  transaction->read({});
  ASSERT_EQ(world_.execute(*transaction).status, Status::committed);
  for (std::uint32_t i = 0; i < 3; ++i)
    EXPECT_EQ(transaction->state(i), nullptr) << i;
}

TEST_F(Reads, OfATransactionThatIsNotDoneReturnNothing) {
  const auto transaction = world_.make();
  transaction->begin({});
  transaction->read(first_);
  transaction->expect_written_by(second_, 77);
  ASSERT_EQ(world_.execute(*transaction).status, Status::conflict);
  EXPECT_EQ(transaction->state(0), nullptr);

  world_.executor.work = [](const auto&, const auto&, const auto&) {
    return query::RunReport{query::RunStatus::device_lost, 0};
  };
  SimulatedQuery query(1);
  transaction->begin({});
  transaction->update(first_, row_of(50));
  transaction->read(first_);
  transaction->add_query(query, 1);
  ASSERT_EQ(world_.execute(*transaction).status, Status::device_lost);
  EXPECT_EQ(transaction->state(0), nullptr) << "the version of that row was not published";
}

TEST(ReadsDeathTest, MisuseAborts) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  World world;
  TransactionOptions options = options_for(1, 1, 1);
  options.max_reads = 1;
  const auto transaction = world.engine.make_transaction(options);
  transaction->begin({});
  transaction->read({0, 1});
  EXPECT_DEATH(transaction->read({0, 1}), "Transaction::read: .*max_reads");
  EXPECT_DEATH(static_cast<void>(transaction->state(0)),
               "Transaction::state: the transaction was not submitted");
  world.execute(*transaction);
  EXPECT_DEATH(static_cast<void>(transaction->state(1)), "Transaction::state: the ordinal is not one");
}

}  // namespace
}  // namespace rtstdb::transaction::test
