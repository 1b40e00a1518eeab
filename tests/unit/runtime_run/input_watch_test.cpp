#include "runtime/run/input_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <vector>

#include "tests/support/allocation_guard.hpp"

namespace hil::run {
namespace {

constexpr std::int64_t ms = 1'000'000;

/// One input in ticks of 1 ms.
class OneInput {
 public:
  explicit OneInput(std::int64_t recovery_ms = 10, std::uint64_t max_rejected = 0, bool has_to_come = true)
      : watch_({{.name = "message can.car.Speed",
                 .has_to_come = has_to_come,
                 .recovery_ns = recovery_ms * ms,
                 .max_rejected = max_rejected}},
               ms) {}
  void ticks(int count, bool is_fresh, bool is_permitted_loss = false) {
    const InputWatch::State state{
        .is_fresh = is_fresh, .has_come = is_fresh, .is_permitted_loss = is_permitted_loss};
    for (int i = 0; i < count; ++i)
      watch_.check(ms * tick_++, {&state, 1});
  }
  void skip(int count) { tick_ += count; }
  void tick(bool is_fresh, bool has_come, bool is_faulted) {
    const InputWatch::State state{.is_fresh = is_fresh, .has_come = has_come, .is_faulted = is_faulted};
    watch_.check(ms * tick_++, {&state, 1});
  }
  /// A fault of the message acts on a frame, so that it is not fresh.
  void faulted_tick() { tick(false, false, true); }
  void fault(bool active) { watch_.set_fault(0, active); }
  void task_fault(bool active) { watch_.set_task_fault(active); }
  std::string failures(std::uint64_t rejected = 0, std::uint64_t by_scenario = 0) const {
    std::string all;
    for (const std::string& sentence : watch_.failures(0, {rejected, by_scenario}))
      all += sentence + "\n";
    return all;
  }
  InputWatch::Figures figures() const { return watch_.figures(0); }

 private:
  InputWatch watch_;
  int tick_ = 0;
};

TEST(InputWatch, InputThatNeverCameIsNamed) {
  OneInput silent;
  silent.ticks(1, false);
  EXPECT_EQ(silent.failures(), "no value of message can.car.Speed came; 'optional: true' permits that\n");
  EXPECT_EQ(silent.failures(1, 1),
            "no value of message can.car.Speed came: its only frame was rejected; 'optional: true' permits "
            "that\n");
  OneInput optional(10, 0, false);
  optional.ticks(1000, false);
  EXPECT_EQ(optional.failures(), "");
}

TEST(InputWatch, LateInputIsJudgedFromItsFirstValueOn) {
  OneInput late;
  late.ticks(900, false);
  late.ticks(100, true);
  EXPECT_EQ(late.failures(), "");
  EXPECT_EQ(late.figures().ticks, 100U);
}

TEST(InputWatch, FivePerCentMayBeMissing) {
  OneInput input;
  input.ticks(10, false);
  input.ticks(950, true);
  input.ticks(50, false);
  EXPECT_EQ(input.failures(), "");
  input.ticks(1, false);
  EXPECT_EQ(input.failures(),
            "message can.car.Speed was not fresh on 51 of 1001 ticks after its first value (5.1 %, first at "
            "0.960 s); 5 % are permitted, 'optional: true' permits more\n");
  input.ticks(100, true);
  EXPECT_EQ(input.failures(), "") << "it recovered, and the share fell";
}

TEST(InputWatch, FaultThatSilencesItExcusesItsTicksAndTheRecovery) {
  OneInput input(10);
  input.ticks(100, true);
  input.fault(true);
  input.ticks(500, false);
  input.fault(false);
  input.ticks(10, false);  // the recovery
  input.ticks(90, true);
  EXPECT_EQ(input.failures(), "");
  EXPECT_EQ(input.figures().ticks, 190U);
  EXPECT_EQ(input.figures().not_fresh, 0U);
  OneInput dead(10);
  dead.ticks(100, true);
  dead.fault(true);
  dead.ticks(500, false);
  dead.fault(false);
  dead.ticks(20, false);
  EXPECT_EQ(dead.figures().not_fresh, 10U) << "it does not come back in its time-out";
  EXPECT_NE(dead.failures(), "");
}

TEST(InputWatch, FaultOfTheMessageExcusesWhileItActsOnFrames) {
  OneInput input(10);
  input.ticks(100, true);
  for (int frame = 0; frame < 20; ++frame) {
    input.faulted_tick();
    input.ticks(9, false);
  }
  EXPECT_EQ(input.figures().not_fresh, 0U);
  input.ticks(50, false);
  EXPECT_EQ(input.figures().not_fresh, 49U) << "no frame came any more for the fault to act on";
  OneInput dropped(10);
  dropped.ticks(70, false);
  for (int frame = 0; frame < 20; ++frame) {
    dropped.faulted_tick();
    dropped.ticks(9, false);
  }
  EXPECT_EQ(dropped.failures(), "") << "it came late, and the fault took all frames";
  dropped.ticks(3, false);
  EXPECT_NE(dropped.failures().find("no value of message can.car.Speed came"), std::string::npos);
}

TEST(InputWatch, RecoveryEndsWithTheFirstFreshTick) {
  OneInput input(100);
  input.fault(true);
  input.ticks(10, true);
  input.fault(false);
  input.ticks(1, true);
  input.ticks(99, false);
  EXPECT_EQ(input.figures().not_fresh, 99U);
}

TEST(InputWatch, FaultOfTheWholeRunExcusesAnInputThatNeverCame) {
  OneInput input;
  input.fault(true);
  input.ticks(100, false);
  EXPECT_EQ(input.failures(), "");
  OneInput before;
  before.ticks(1, false);
  before.fault(true);
  before.ticks(100, false);
  EXPECT_NE(before.failures(), "") << "it had not come before the fault";
}

TEST(InputWatch, FaultOfATaskExcusesWhileTicksAreSkipped) {
  OneInput input(10);
  input.ticks(100, true);
  input.task_fault(true);
  for (int i = 0; i < 20; ++i) {
    input.skip(30);
    input.ticks(1, false);
  }
  input.task_fault(false);
  input.ticks(100, true);
  EXPECT_EQ(input.failures(), "");
  OneInput punctual(10);
  punctual.ticks(100, true);
  punctual.task_fault(true);
  punctual.ticks(100, false);
  EXPECT_EQ(punctual.figures().not_fresh, 100U) << "no tick was skipped, so the fault is not why";
  OneInput slow(10);
  slow.ticks(100, true);
  for (int i = 0; i < 20; ++i) {
    slow.skip(30);
    slow.ticks(1, false);
  }
  EXPECT_EQ(slow.figures().not_fresh, 20U) << "a slow machine is no fault of the scenario";
}

TEST(InputWatch, PermittedLossExcuses) {
  OneInput input;
  input.ticks(100, true);
  input.ticks(500, false, true);
  EXPECT_EQ(input.failures(), "");
}

TEST(InputWatch, RejectedFramesBeyondTheLimitAreCountedWithoutThoseOfTheScenario) {
  OneInput input(10, 2);
  input.ticks(100, true);
  EXPECT_EQ(input.failures(2), "");
  EXPECT_EQ(input.failures(7, 5), "");
  EXPECT_EQ(input.failures(8, 5),
            "3 frames of message can.car.Speed were rejected for a wrong checksum, counter or format; "
            "max_rejected is 2\n");
  EXPECT_EQ(OneInput().failures(1),
            "1 frame of message can.car.Speed was rejected for a wrong checksum, counter or format; "
            "max_rejected is 0\n");
  EXPECT_NE(OneInput(10, 0, false).failures(1), "") << "optional permits silence, not wrong frames";
}

TEST(InputWatch, ShortFaultsDoNotExcuseADeadDevice) {
  OneInput dead(20);
  dead.ticks(50, true);
  for (int i = 0; i < 20; ++i) {
    dead.ticks(14, false);
    dead.fault(true);
    dead.ticks(1, false);
    dead.fault(false);
  }
  EXPECT_EQ(dead.figures().not_fresh, 300U) << "it was stale when the first one began";
  OneInput once(20);
  once.ticks(50, true);
  for (int i = 0; i < 20; ++i) {
    once.fault(true);
    once.ticks(1, false);
    once.fault(false);
    once.ticks(14, false);
  }
  EXPECT_EQ(once.figures().not_fresh, 300U - 2U - 20U) << "one time-out without a fault, over all faults";
  OneInput alive(20);
  for (int i = 0; i < 20; ++i) {
    alive.ticks(2, true);
    alive.fault(true);
    alive.ticks(1, false);
    alive.fault(false);
    alive.ticks(14, false);
  }
  EXPECT_EQ(alive.figures().not_fresh, 0U) << "it comes back each time";
}

TEST(InputWatch, LongFaultsInShortSuccessionExcuse) {
  OneInput input(20);
  input.ticks(50, true);
  for (int i = 0; i < 4; ++i) {
    input.fault(true);
    input.ticks(200, false);
    input.fault(false);
    input.ticks(5, false);  // less than the device needs
  }
  EXPECT_EQ(input.figures().not_fresh, 0U);
  input.ticks(1, false);
  EXPECT_EQ(input.figures().not_fresh, 1U);
}

TEST(InputWatch, SignalIsNamedWhereItsGroupHasCome) {
  InputWatch watch({{.name = "message can.car.Rep"},
                    {.name = "signal can.car.Rep.B", .group = 0},
                    {.name = "signal can.car.Rep.C", .group = 0}},
                   ms);
  for (int tick = 0; tick < 100; ++tick) {
    const std::array states{InputWatch::State{.is_fresh = true}, InputWatch::State{},
                            InputWatch::State{.is_fresh = tick < 90}};
    watch.check(ms * tick, states);
  }
  EXPECT_TRUE(watch.failures(0, {}).empty());
  ASSERT_EQ(watch.failures(1, {}).size(), 1U);
  EXPECT_EQ(watch.failures(1, {})[0],
            "no value of signal can.car.Rep.B came; 'optional: true' at its message permits that");
  ASSERT_EQ(watch.failures(2, {}).size(), 1U);
  EXPECT_EQ(watch.failures(2, {})[0],
            "signal can.car.Rep.C was not fresh on 10 of 100 ticks after its first value (10.0 %, first at "
            "0.090 s); 5 % are permitted, 'optional: true' at its message permits more");
  InputWatch silent({{.name = "message can.car.Rep"}, {.name = "signal can.car.Rep.B", .group = 0}}, ms);
  silent.check(0, std::array{InputWatch::State{}, InputWatch::State{}});
  EXPECT_EQ(silent.failures(0, {}).size(), 1U);
  EXPECT_TRUE(silent.failures(1, {}).empty()) << "the message says it";
}

/// Judges each tick from the whole history.
TEST(InputWatch, RandomHistoriesAgreeWithCountingAfterwards) {
  constexpr std::uint64_t seed = 74'006;
  std::mt19937_64 random(seed);
  int failed = 0;
  for (int round = 0; round < 300; ++round) {
    const auto recovery = static_cast<int>(random() % 20);
    OneInput input(recovery);
    struct Tick {
      bool fresh, came, silenced, faulted;
    };
    std::vector<Tick> ticks;
    Tick now{random() % 3 == 0, false, random() % 4 == 0, false};
    const std::uint64_t faulted_share = round % 3 == 0 ? 12 : 100'000;
    if (now.silenced) input.fault(true);
    for (int i = 0; i < 400; ++i) {
      if (random() % 25 == 0) now.fresh = random() % 5 != 0;
      if (random() % (round % 2 == 0 ? 60 : 8) == 0) {
        now.silenced = !now.silenced;
        input.fault(now.silenced);
      }
      now.faulted = random() % faulted_share == 0;
      now.came = now.fresh && (random() % 3 == 0 || ticks.empty() || !ticks.back().fresh);
      ticks.push_back(now);
      input.tick(now.fresh, now.came, now.faulted);
    }
    const auto was_sent = [](const Tick& tick) { return tick.came || tick.faulted; };
    const bool has_come = std::ranges::any_of(ticks, &Tick::came);
    const auto first = static_cast<std::size_t>(std::ranges::find_if(ticks, was_sent) - ticks.begin());
    std::uint64_t counted = 0, missing = 0;
    for (std::size_t i = first < ticks.size() ? first : 0; i < ticks.size(); ++i) {
      bool excused = ticks[i].silenced || ticks[i].faulted;
      if (!ticks[i].fresh) {
        int undisturbed = 0;
        bool has_reason = false;
        for (std::size_t k = i;; --k) {  // back to the last sign of life
          const bool begins_fresh = ticks[k].fresh || k == 0 || ticks[k - 1].fresh;
          has_reason = has_reason || ticks[k].faulted || (ticks[k].silenced && begins_fresh);
          if (k == 0 || was_sent(ticks[k])) break;
        }
        for (std::size_t k = i; !was_sent(ticks[k]); --k) {
          undisturbed += !ticks[k].fresh && !ticks[k].silenced ? 1 : 0;
          if (k == 0) break;
        }
        excused = has_reason && undisturbed <= recovery;
      }
      if (excused) continue;
      ++counted;
      if (!ticks[i].fresh) ++missing;
    }
    ASSERT_EQ(input.figures().ticks, counted) << "seed " << seed << ", round " << round;
    ASSERT_EQ(input.figures().not_fresh, missing) << "seed " << seed << ", round " << round;
    const bool fails = has_come ? 20 * missing > counted : missing > 0;
    ASSERT_EQ(!input.failures().empty(), fails) << "seed " << seed << ", round " << round;
    failed += fails ? 1 : 0;
  }
  EXPECT_TRUE(failed > 20 && failed < 280) << failed << ": both outcomes have to occur";
}

TEST(InputWatch, TickDoesNotAllocate) {
  std::vector<InputWatch::InputRule> subjects(100, {.name = "register modbus.plc.level"});
  InputWatch watch(std::move(subjects), ms);
  const std::vector<InputWatch::State> states(100, {.is_fresh = true});
  allocation_guard::reset();
  allocation_guard::enter_tick();
  watch.set_fault(3, true);
  watch.set_task_fault(true);
  for (int tick = 0; tick < 100; ++tick)
    watch.check(tick * ms, states);
  watch.set_fault(3, false);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

}  // namespace
}  // namespace hil::run
