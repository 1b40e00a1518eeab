// Faults that a run injects into a Modbus unit: as the client sees it, and as clients see the server.

#include <gtest/gtest.h>

#include <memory>

#include "io/modbus/client_device.hpp"
#include "io/modbus/server_device.hpp"
#include "registers.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::io::modbus {
namespace {

using std::chrono::milliseconds;
using test::entry;
using test::latched;
using tests::eventually;

constexpr std::int64_t ms = 1'000'000;

RegisterMap map_with(bool level_is_written) {
  return {{entry("level", Table::holding, 0, ValueType::u16, level_is_written),
           entry("pump", Table::holding, 1, ValueType::u16, !level_is_written)}};
}

class InjectedFaults : public testing::Test {
 protected:
  void start(Pacing pacing, const std::vector<Interference>& of_client,
             const std::vector<Interference>& of_server = {}) {
    for (const Interference& injected : of_server)
      server_.add_fault(injected);
    server_.start(wall_, Pacing::realtime);
    ClientSettings settings{.name = "plc"};
    settings.endpoint.port = server_.port();
    settings.response_timeout = milliseconds(50);
    settings.max_age = milliseconds(100);
    client_ = std::make_unique<ClientDevice>(settings, map_with(true));
    for (const Interference& injected : of_client)
      client_->add_fault(injected);
    client_->start(pacing == Pacing::lockstep ? static_cast<const RunClock&>(hand_) : wall_, pacing);
    server_.release_outputs(std::vector{7.0}, 0);
  }
  void TearDown() override {
    if (client_) client_->stop();
    server_.stop();
  }
  /// A cycle in lock-step at this tick.
  void cycle(std::int64_t time_ns) {
    hand_.set(time_ns);
    client_->release_outputs(std::vector{1.0}, time_ns);
    EXPECT_TRUE(client_->exchange(time_ns)) << client_->fault();
  }
  bool cycles_until(const std::function<bool()>& condition) {
    return eventually([&] {
      client_->release_outputs(std::vector{1.0}, wall_.now_ns());
      return condition();
    });
  }

  RunningClock wall_;
  SetClock hand_;
  ServerDevice server_{{.name = "unit"}, map_with(false)};
  std::unique_ptr<ClientDevice> client_;
};

TEST_F(InjectedFaults, LockstepUnitIsSilentAndComesBack) {
  start(Pacing::lockstep, {{.is_silent = true}});
  cycle(0);
  EXPECT_TRUE(latched(*client_)[0].fresh);
  client_->set_fault(0, true);
  for (int tick = 1; tick <= 20; ++tick)
    cycle(tick * 10 * ms);
  EXPECT_FALSE(client_->connected());
  EXPECT_FALSE(latched(*client_)[0].fresh) << "older than max_age";
  EXPECT_NE(client_->fault().find("fault of the scenario"), std::string::npos) << client_->fault();
  EXPECT_EQ(client_->fault_count(0), 20u);
  client_->set_fault(0, false);
  cycle(210 * ms);
  EXPECT_TRUE(client_->connected());
  EXPECT_TRUE(latched(*client_)[0].fresh);
}

TEST_F(InjectedFaults, LockstepRepliesAreLate) {
  start(Pacing::lockstep, {{.delay = milliseconds(30)}});
  cycle(0);
  server_.release_outputs(std::vector{9.0}, 0);
  client_->set_fault(0, true);
  for (const int tick : {10, 20, 30}) {
    cycle(tick * ms);
    EXPECT_EQ(latched(*client_)[0].time_ns, 0) << "the reply of the cycle at 10 ms is due at 40 ms";
  }
  cycle(40 * ms);
  EXPECT_EQ(latched(*client_)[0].value, 9.0);
  EXPECT_EQ(latched(*client_)[0].time_ns, 40 * ms);
}

TEST_F(InjectedFaults, LockstepDelayCountsAsAnEffectWhenTheFaultEndsBeforeTheReply) {
  start(Pacing::lockstep, {{.delay = milliseconds(30)}});
  cycle(0);
  EXPECT_EQ(client_->fault_effects(0), 0u);
  client_->set_fault(0, true);
  cycle(10 * ms);
  client_->set_fault(0, false);
  cycle(20 * ms);
  EXPECT_EQ(latched(*client_)[0].time_ns, 20 * ms);
  EXPECT_EQ(client_->fault_effects(0), 1u);
}

TEST_F(InjectedFaults, LockstepRepliesBeyondTheTimeOutAreTimeOuts) {
  start(Pacing::lockstep, {{.delay = milliseconds(60)}});
  client_->set_fault(0, true);
  for (int tick = 0; tick <= 5; ++tick)
    cycle(tick * 10 * ms);
  EXPECT_FALSE(client_->connected());
}

TEST_F(InjectedFaults, LockstepExceptionsRefuseEachRequest) {
  start(Pacing::lockstep, {{.exception = 6}});
  cycle(0);
  client_->set_fault(0, true);
  for (int tick = 1; tick <= 30; ++tick)
    cycle(tick * 10 * ms);
  EXPECT_TRUE(client_->connected());
  EXPECT_FALSE(latched(*client_)[0].fresh);
  EXPECT_GE(client_->counters().by_code[6], 30u);
  EXPECT_EQ(client_->send_fault(), "") << "refused outputs are the fault's";
  client_->set_fault(0, false);
  cycle(310 * ms);
  EXPECT_TRUE(latched(*client_)[0].fresh);
}

TEST_F(InjectedFaults, LockstepDoesNotWaitForAUnitThatIsAway) {
  start(Pacing::lockstep, {});
  cycle(0);
  client_->set_away(-1, true);
  server_.stop();
  cycle(10 * ms);
  EXPECT_FALSE(client_->connected());
}

TEST_F(InjectedFaults, RealTimeUnitIsSilentSlowAndDisconnected) {
  start(Pacing::realtime, {{.is_silent = true}, {.delay = milliseconds(20)}, {.is_disconnected = true}});
  ASSERT_TRUE(cycles_until([&] { return latched(*client_)[0].fresh; }));
  client_->set_fault(0, true);
  EXPECT_TRUE(cycles_until([&] { return client_->counters().timeouts > 0 && !client_->connected(); }));
  client_->set_fault(0, false);
  EXPECT_TRUE(cycles_until([&] { return client_->connected() && latched(*client_)[0].fresh; }));
  client_->set_fault(1, true);
  const std::uint64_t before = client_->fault_count(1);
  EXPECT_TRUE(cycles_until([&] { return client_->fault_count(1) >= before + 5; }));
  EXPECT_TRUE(client_->connected()) << "20 ms are within its time-out of 50 ms";
  client_->set_fault(1, false);
  client_->set_fault(2, true);
  EXPECT_TRUE(cycles_until([&] { return !client_->connected() && server_.counters().accepted > 0; }));
  EXPECT_NE(client_->fault().find("disconnected by a fault"), std::string::npos) << client_->fault();
  client_->set_fault(2, false);
  EXPECT_TRUE(cycles_until([&] { return client_->connected(); }));
}

TEST_F(InjectedFaults, ServerIsSilentRefusesAndDisconnects) {
  start(Pacing::realtime, {}, {{.is_silent = true}, {.exception = 4}, {.is_disconnected = true}});
  ASSERT_TRUE(cycles_until([&] { return latched(*client_)[0].fresh; }));
  server_.set_fault(0, true);
  EXPECT_TRUE(cycles_until([&] { return client_->counters().timeouts > 0; }));
  EXPECT_GT(server_.fault_count(0), 0u);
  server_.set_fault(0, false);
  server_.set_fault(1, true);
  EXPECT_TRUE(cycles_until([&] { return client_->counters().by_code[4] > 0; }));
  server_.set_fault(1, false);
  EXPECT_TRUE(cycles_until([&] { return client_->connected() && latched(*client_)[0].fresh; }));
  server_.set_fault(2, true);
  EXPECT_TRUE(cycles_until([&] { return !client_->connected() && !server_.connected(); }));
  server_.set_fault(2, false);
  EXPECT_TRUE(cycles_until([&] { return client_->connected() && server_.connected(); }));
}

TEST_F(InjectedFaults, ServerRepliesLate) {
  start(Pacing::realtime, {}, {{.delay = milliseconds(20)}, {.delay = milliseconds(200)}});
  ASSERT_TRUE(cycles_until([&] { return latched(*client_)[0].fresh; }));
  ASSERT_TRUE(eventually([&] { return client_->counters().requests == server_.counters().replies; }));
  server_.set_fault(0, true);
  const std::uint64_t replies = client_->counters().replies;
  const std::int64_t began_ns = wall_.now_ns();
  client_->release_outputs(std::vector{1.0}, began_ns);
  EXPECT_TRUE(eventually([&] { return client_->counters().replies > replies; }));
  EXPECT_GE(wall_.now_ns() - began_ns, 20 * ms);
  EXPECT_TRUE(cycles_until([&] { return server_.fault_count(0) >= 5; }));
  EXPECT_GE(server_.fault_effects(0), 5u);
  EXPECT_TRUE(client_->connected()) << "20 ms are within its time-out of 50 ms";
  server_.set_fault(1, true);
  EXPECT_TRUE(cycles_until([&] { return client_->counters().timeouts > 0; }));
  server_.set_fault(0, false);
  server_.set_fault(1, false);
  EXPECT_TRUE(cycles_until([&] { return client_->connected() && latched(*client_)[0].fresh; }));
}

TEST_F(InjectedFaults, ServerRepliesLateByTheVirtualClock) {
  server_.add_fault({.delay = milliseconds(30)});
  server_.start(hand_, Pacing::lockstep);
  ClientSettings settings{.name = "master"};
  settings.endpoint.port = server_.port();
  settings.response_timeout = std::chrono::seconds(20);
  client_ = std::make_unique<ClientDevice>(settings, map_with(true));
  client_->start(wall_, Pacing::realtime);
  const auto exchange_at = [&](std::int64_t time_ns) {
    hand_.set(time_ns);
    EXPECT_TRUE(server_.exchange(time_ns));
  };
  server_.set_fault(0, true);
  client_->release_outputs(std::vector{1.0}, 0);
  ASSERT_TRUE(eventually([&] {
    exchange_at(10 * ms);
    return server_.fault_effects(0) == 1;
  }));
  exchange_at(20 * ms);
  exchange_at(39 * ms);
  EXPECT_EQ(server_.counters().replies, 0u);
  EXPECT_FALSE(latched(server_)[0].fresh);
  exchange_at(40 * ms);
  EXPECT_EQ(server_.counters().replies, 1u);
  EXPECT_EQ(latched(server_)[0].time_ns, 40 * ms) << "the request is carried out when it is answered";
  // The next request is answered when the fault ends.
  ASSERT_TRUE(eventually([&] {
    exchange_at(50 * ms);
    return server_.fault_effects(0) == 2;
  }));
  server_.set_fault(0, false);
  exchange_at(60 * ms);
  EXPECT_EQ(server_.counters().replies, 2u);
}

TEST_F(InjectedFaults, SafeValuesReachASilentUnit) {
  for (const Pacing pacing : {Pacing::lockstep, Pacing::realtime}) {
    const std::int64_t requests = static_cast<std::int64_t>(server_.counters().requests);
    start(pacing, {{.is_silent = true}});
    client_->set_fault(0, true);
    client_->enter_safe_state();
    EXPECT_TRUE(
        eventually([&] { return server_.counters().requests > static_cast<std::uint64_t>(requests); }));
    EXPECT_TRUE(eventually([&] { return client_->connected(); }));
    client_->stop();
    server_.stop();
  }
}

TEST_F(InjectedFaults, SilenceInputsWhereNoReplyComesInTime) {
  start(Pacing::lockstep,
        {{.is_silent = true},
         {.is_disconnected = true},
         {.exception = 6},
         {.delay = milliseconds(50)},
         {.delay = milliseconds(51)}},
        {{.delay = milliseconds(51)}});
  for (const std::size_t fault : {0, 1, 2, 4})
    EXPECT_TRUE(client_->silences(fault)) << fault;
  EXPECT_FALSE(client_->silences(3)) << "its time-out";
  EXPECT_FALSE(server_.silences(0)) << "its inputs stay fresh";
}

}  // namespace
}  // namespace hil::io::modbus
