// A setup call finds the device lost and has no memory for the recovery: it returns an error, and the next
// call tries again.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include <rtstdb/database.hpp>

#include "rtstdb/open_database.hpp"
#include "tests/gpu/failing_allocation.hpp"
#include "tests/gpu/fault_loader.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::test {
namespace {

using gpu::test::FaultLoader;
using SteadyClock = std::chrono::steady_clock;

const std::uint64_t stride = hil::tests::is_long() ? 7 : 211;

class RecoveryWithoutMemory : public testing::Test {
 protected:
  void SetUp() override {
    DatabaseOptions options;
    if (const char* select = std::getenv("HIL_TEST_GPU")) options.gpu = select;
    options.max_entities = 16;
    options.validation = Validation::off;
    gpu::DeviceOptions device_options;
    device_options.loader_library = FAULT_LOADER;
    auto opened = open_database(options, device_options);
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    database_ = std::move(opened).value();
    const GeometryId box = database_->add_geometry(make_box({2.0, 2.0, 2.0}), "box").value();
    query_ = database_->prepare(RayQueryOptions{.name = "beam", .capacity = 1}).value();
    query_->rays()[0].origin_m = {-6.0f, 0.0f, 0.0f};
    transaction_ = database_->make_transaction({.max_writes = 1, .max_queries = 1});
    transaction_->begin({});
    EntityRow row;
    row.geometry = box;
    transaction_->create(row);
    ASSERT_EQ(database_->execute(*transaction_).status, Status::committed);
    ASSERT_EQ(run_query(), Status::committed);
  }

  Status run_query() {
    transaction_->begin({});
    transaction_->add_query(*query_, 1);
    return database_->execute(*transaction_).status;
  }

  FaultLoader loader_;
  std::unique_ptr<Database> database_;
  std::unique_ptr<RayQuery> query_;
  std::unique_ptr<Transaction> transaction_;
};

TEST_F(RecoveryWithoutMemory, IsTriedAgain) {
  std::uint64_t number = 1;
  std::uint64_t failed = 0;
  for (bool reached = true; reached; number += stride) {
    SCOPED_TRACE(testing::Message() << "allocation " << number);
    loader_.lose_at_call(1);
    {
      const FailingAllocation failing(number, FailingAllocation::Then::goes_on);
      const auto prepared = database_->prepare(RayQueryOptions{.name = "late", .capacity = 1});
      loader_.lose_at_call(0);
      reached = failing.happened();
      failed += prepared.ok() ? 0 : 1;
      if (!prepared.ok()) {
        EXPECT_EQ(prepared.error().code, ErrorCode::out_of_memory) << prepared.error().message;
      }
    }
    const auto end = SteadyClock::now() + std::chrono::seconds(20);
    Status status = run_query();
    while (status == Status::device_lost && SteadyClock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));  // until the next recovery attempt
      status = run_query();
    }
    ASSERT_EQ(status, Status::committed);
    EXPECT_EQ(query_->hits()[0].status, HitStatus::hit);
  }
  EXPECT_GT(failed, 2u) << "of " << number << " allocations";
}

}  // namespace
}  // namespace rtstdb::test
