#include "runtime/signals/signal_table.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

namespace hil::signals {
namespace {

TEST(SignalTable, FindsSignalsByNameAndAlias) {
  SignalTable table;
  const SignalId speed = table.add({"can.car.LongName.Speed", "m/s", "can.car"});
  const SignalId brake = table.add({"can.car.Brake", "", "can.car"});
  table.add_alias("can.car.Short.Speed", speed);
  table.add_alias("can.car.Brake", speed);
  EXPECT_EQ(table.find("can.car.LongName.Speed"), speed);
  EXPECT_EQ(table.find("can.car.Short.Speed"), speed);
  EXPECT_EQ(table.find("can.car.Brake"), brake) << "a name precedes an alias";
  EXPECT_FALSE(table.find("can.car.Brak"));
  EXPECT_FALSE(table.find(""));
  EXPECT_EQ(table.names(), (std::vector<std::string>{"can.car.LongName.Speed", "can.car.Brake"}));
  table.set_named_values(brake, {{"on", 1.0}});
  EXPECT_EQ(table.info(brake).named_values.at("on"), 1.0);
  EXPECT_EQ(table.info(speed).unit, "m/s");
}

TEST(SignalTable, KeepsValuesWithTimeAndFreshness) {
  SignalTable table;
  const SignalId a = table.add({"a", "m", "x", 7.25});
  const SignalId b = table.add({"b", "m", "x"});
  EXPECT_EQ(table.value(a), 7.25);
  EXPECT_FALSE(table.read(a).fresh);
  EXPECT_EQ(table.read(a).time_ns, std::numeric_limits<std::int64_t>::min());
  table.write(a, 1.5, 42);
  EXPECT_EQ(table.value(a), 1.5);
  EXPECT_EQ(table.read(a).time_ns, 42);
  EXPECT_TRUE(table.read(a).fresh);
  EXPECT_FALSE(table.read(b).fresh) << "a write changes one signal only";
  table.write(b, SignalValue{2.0, 43, false});
  EXPECT_FALSE(table.read(b).fresh) << "a value can be written as not fresh";
  ASSERT_EQ(table.values().size(), 2U);
  EXPECT_EQ(table.values()[1].value, 2.0);
}

TEST(SignalTable, HasTheReadObserversOfSeveralSignals) {
  struct Observer final : ReadObserver {
    void note_read(ReadBy /*by*/) noexcept override {}
  };
  Observer one, two;
  SignalTable table;
  const SignalId a = table.add({.name = "a", .unit = "", .writer = "w"});
  const SignalId b = table.add({.name = "b", .unit = "", .writer = "w"});
  const SignalId c = table.add({.name = "c", .unit = "", .writer = "w"});
  table.add_read_observer(a, one);
  table.add_read_observer(b, one);
  table.add_read_observer(b, two);
  EXPECT_EQ(table.read_observers({{a, b, c}}), (std::vector<ReadObserver*>{&one, &two}));
  EXPECT_TRUE(table.read_observers({{c, SignalId{}}}).empty());
}

TEST(SignalTableDeathTest, DuplicateNameIsMisuse) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  SignalTable table;
  const SignalInfo info{"a", "m", "x"};
  table.add(info);
  EXPECT_DEATH(table.add(info), "signal 'a' added twice");
}

}  // namespace
}  // namespace hil::signals
