#include "runtime/signals/signal_table.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace hil::signals {
namespace {

TEST(SignalTable, GivesIdsInOrderAndFindsThemAgain) {
  SignalTable table;
  const SignalId speed = table.add({"ego.speed", "m/s", "traffic", 3.5});
  const SignalId brake = table.add({"ego.brake", "", "dut", 0.0});
  EXPECT_EQ(speed.index, 0U);
  EXPECT_EQ(brake.index, 1U);
  EXPECT_EQ(table.find("ego.speed"), speed);
  EXPECT_EQ(table.find("ego.brake"), brake);
  EXPECT_FALSE(table.find("ego.spee").has_value());
  EXPECT_FALSE(table.find("").has_value());
  EXPECT_EQ(table.size(), 2U);
  EXPECT_EQ(table.info(speed).unit, "m/s");
  EXPECT_EQ(table.info(brake).writer, "dut");
  EXPECT_FALSE(SignalId{}.valid());
  EXPECT_TRUE(speed.valid());
}

TEST(SignalTable, FindsASignalByItsOtherNamesToo) {
  SignalTable table;
  const SignalId speed = table.add({"can.car.LongName.Speed", "m/s", "can.car"});
  const SignalId brake = table.add({"can.car.Brake", "", "can.car"});
  table.add_alias("can.car.Short.Speed", speed);
  table.add_alias("can.car.Brake", speed);
  EXPECT_EQ(table.find("can.car.Short.Speed"), speed);
  EXPECT_EQ(table.find("can.car.Brake"), brake) << "a name goes before an alias";
  EXPECT_EQ(table.size(), 2U);
  table.set_named_values(brake, {{"on", 1.0}});
  EXPECT_EQ(table.info(brake).named_values.at("on"), 1.0);
}

TEST(SignalTable, StartsAtTheInitialValueAndStale) {
  SignalTable table;
  const SignalId id = table.add({"a", "m", "x", 7.25});
  EXPECT_EQ(table.value(id), 7.25);
  EXPECT_FALSE(table.read(id).fresh);
  EXPECT_EQ(table.read(id).time_ns, std::numeric_limits<std::int64_t>::min());
}

TEST(SignalTable, KeepsWhatWasWrittenAndWhen) {
  SignalTable table;
  const SignalId a = table.add({"a", "m", "x"});
  const SignalId b = table.add({"b", "m", "x"});
  table.write(a, 1.5, 42);
  EXPECT_EQ(table.value(a), 1.5);
  EXPECT_EQ(table.read(a).time_ns, 42);
  EXPECT_TRUE(table.read(a).fresh);
  EXPECT_FALSE(table.read(b).fresh) << "a write reaches one signal only";
  table.write(b, SignalValue{2.0, 43, false});
  EXPECT_FALSE(table.read(b).fresh) << "a lost writer's value can be passed on as stale";
  ASSERT_EQ(table.values().size(), 2U);
  EXPECT_EQ(table.values()[1].value, 2.0);
}

TEST(SignalTable, ListsItsNamesWithoutAliases) {
  SignalTable table;
  EXPECT_TRUE(table.names().empty());
  const SignalId speed = table.add({"traffic.ego_speed", "m/s", "traffic"});
  table.add({"detectors.ego", "", "detectors"});
  table.add_alias("traffic.speed", speed);
  EXPECT_EQ(table.names(), (std::vector<std::string>{"traffic.ego_speed", "detectors.ego"}));
}

TEST(SignalTableDeathTest, RefusesTheSameNameTwice) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  SignalTable table;
  const SignalInfo info{"a", "m", "x"};
  table.add(info);
  EXPECT_DEATH(table.add(info), "signal 'a' added twice");
}

TEST(SignalTable, HoldsManySignals) {
  SignalTable table;
  for (int i = 0; i < 5000; ++i)
    table.add({std::to_string(i), "", "w", static_cast<double>(i)});
  for (int i = 0; i < 5000; ++i) {
    const auto id = table.find(std::to_string(i));
    ASSERT_TRUE(id.has_value());
    EXPECT_EQ(table.value(*id), i);
  }
}

}  // namespace
}  // namespace hil::signals
