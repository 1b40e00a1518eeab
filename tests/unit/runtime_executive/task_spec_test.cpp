#include <gtest/gtest.h>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using test::spec_of;
constexpr std::int64_t ms = 1'000'000;

std::string refusal(const TaskSpec& spec) {
  return why_refused(spec, ms).value_or("");
}

TEST(TaskSpec, DefaultsAreAccepted) {
  EXPECT_EQ(refusal(spec_of("a")), "");
  EXPECT_EQ(effective_deadline_ns(spec_of("a", 10), ms), 10 * ms);
}

TEST(TaskSpec, OutOfRangeIsRefusedWithItsValues) {
  EXPECT_EQ(refusal(spec_of("")), "a task needs a name");
  EXPECT_EQ(refusal(spec_of("a", 0)), "task 'a': runs every 0 ticks; at least 1");

  TaskSpec spec = spec_of("a", 10);
  spec.offset_ticks = 10;
  EXPECT_EQ(refusal(spec), "task 'a': offset of 10 ticks; it runs every 10, so at most 9");

  spec = spec_of("a", 10);
  spec.deadline_ns = 11 * ms;
  EXPECT_EQ(refusal(spec), "task 'a': deadline of 11000000 ns; from 0 to its period of 10000000 ns");
  spec.deadline_ns = -1;
  EXPECT_NE(refusal(spec), "");

  spec = spec_of("a", 10, "threaded");
  spec.deadline_ns = 2 * ms + 1;
  EXPECT_NE(refusal(spec).find("a multiple of the base period of 1000000 ns"), std::string::npos);
  spec.thread = "";
  EXPECT_EQ(refusal(spec), "") << "on the base thread any deadline is accepted";

  spec = spec_of("a");
  spec.budget_ns = ms + 1;
  EXPECT_EQ(refusal(spec), "task 'a': budget of 1000001 ns; from 0 to its deadline of 1000000 ns");

  spec = spec_of("a");
  spec.overrun = OverrunPolicy::abort;
  EXPECT_NE(refusal(spec).find("abort needs a thread of its own"), std::string::npos);
  spec.thread = "threaded";
  EXPECT_EQ(refusal(spec), "");
}

TEST(ExecutiveDeathTest, MisuseIsAsserted) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  test::FakeRun fake(1);
  test::ScriptedTask task;
  EXPECT_DEATH(Executive(ExecutiveOptions{}), "an executive needs a clock");
  Executive executive(fake.options);
  executive.add_task(spec_of("a"), task);
  EXPECT_DEATH(executive.add_task(spec_of("a"), task), "each task has a name of its own");
  EXPECT_DEATH(executive.add_task(spec_of("b", 0), task), "checked with why_refused first");
  executive.run(fake.stop);
  EXPECT_DEATH(executive.run(fake.stop), "runs once");
}

}  // namespace
}  // namespace hil::executive
