// Misuse of a database aborts with the call and the fault, and names no folder of the build.

#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>

#include <rtstdb/database.hpp>
#include <rtstdb/image.hpp>

#include "tests/gpu/database_fixture.hpp"

namespace rtstdb::test {
namespace {

class MisuseDeathTest : public ::testing::Test {
 protected:
  // The tests open their databases in the process that dies.
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
  static std::unique_ptr<Database> open() {
    auto opened = Database::open({});
    EXPECT_TRUE(opened.ok());
    return std::move(opened).value();
  }
};

TEST_F(MisuseDeathTest, AnOutcomeBeforeSubmit) {
  EXPECT_DEATH(static_cast<void>(open()->make_transaction({})->outcome()),
               "^rtstdb was misused: Transaction::outcome: the transaction was not submitted");
  EXPECT_DEATH(
      {
        const auto database = open();
        const auto transaction = database->make_transaction({});
        transaction->begin({});
        static_cast<void>(database->execute(*transaction));
        transaction->begin({});
        static_cast<void>(transaction->outcome());
      },
      "^rtstdb was misused: Transaction::outcome: ");
}

TEST_F(MisuseDeathTest, AQueryThatOutlivesItsDatabase) {
  EXPECT_DEATH(
      {
        auto database = open();
        const auto query = database->prepare(RayQueryOptions{.name = "late", .capacity = 1});
        database.reset();
      },
      "^rtstdb was misused: Database's destructor: a prepared query outlives its database");
}

TEST_F(MisuseDeathTest, ExecuteAfterFork) {
  EXPECT_EXIT(
      {
        const auto database = open();
        const auto transaction = database->make_transaction({});
        transaction->begin({});
        const pid_t child = fork();
        if (child == 0) {
          static_cast<void>(database->execute(*transaction));
          _exit(0);
        }
        int status = 0;
        waitpid(child, &status, 0);
        // The parent's database works on.
        _exit(WIFSIGNALED(status) && database->execute(*transaction).done() ? 7 : 1);
      },
      ::testing::ExitedWithCode(7), "^rtstdb was misused: Database::submit: this process was forked");
}

TEST_F(MisuseDeathTest, APixelBeyondTheImage) {
  EXPECT_DEATH(static_cast<void>(pixel_ray({}, 4, 4, 4, 0)), "^rtstdb was misused: pixel_ray: ");
}

TEST_F(MisuseDeathTest, ARuleInsideTheDatabaseHasNoBuildPath) {
  EXPECT_DEATH(assertion_failed("the ring is full", "/somewhere/rtstdb/build/../rtstdb/log/ring.cpp", 12),
               "^rtstdb/log/ring.cpp:12: assertion failed: the ring is full");
}

}  // namespace
}  // namespace rtstdb::test
