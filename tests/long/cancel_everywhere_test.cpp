// cancel at every state: one that waits, runs, stands interrupted, shares a run, has to begin anew, or is
// being published; reserved or not. Each has one outcome, and left what that says.

#include <gtest/gtest.h>

#include <array>
#include <iostream>

#include "tests/support/rounds.hpp"
#include "tests/support/simulation/engine.hpp"

namespace hil::stress {
namespace {

using namespace std::chrono_literals;
using namespace rtstdb;
using namespace rtstdb::transaction::test;

constexpr std::uint32_t chunk = 4096;

/// A long batch is under way when a writer that asks interrupts it, which a reserved one makes begin anew;
/// then two small readers share a run.
class Scene {
 public:
  enum Who : std::size_t { batch, writer, reserved, first_reader, second_reader, count };

  Scene() {
    world_.executor.chunk = [this](const auto&, const query::Request& request, std::uint32_t first,
                                   std::uint32_t end) {
      world_.clock.advance(500us * (end - first) / chunk);
      chunk_done(request, first);
    };
    for (std::size_t k = 0; k < count; ++k) {
      queries_.push_back(std::make_unique<SimulatedQuery>(8 * chunk, static_cast<int>(k)));
      made_.push_back(world_.make());
      entities_.push_back(world_.create(0));
    }
    // Until it is known what they cost.
    for (std::uint32_t k = 0; k < 40; ++k) {
      declare(batch, {}, chunk * (1 + k % 4));
      world_.execute(*made_[batch]);
    }
    reservation_ =
        std::move(
            world_.engine.reserve(
                {.name = "r", .period = 100ms, .deadline = 20ms, .budget = 2ms, .writes_and_queries = true}))
            .value();
  }

  /// Cancels one of them at a reading of the clock. How many of them were cancelled; negative: something is
  /// wrong.
  int run(Who whom, int reading) {
    begun_ = {};
    world_.clock.advance(200ms);
    declare(batch, terms(DeadlineClass::soft), 6 * chunk);
    world_.clock.call_at_reading(reading, [&] {
      if (made_[whom]->status() == Status::pending) world_.engine.cancel(*made_[whom]);
    });
    world_.engine.submit(*made_[batch]);
    int cancelled = 0;
    world_.engine.wait(*made_[batch]);
    for (std::size_t k = 0; k < count; ++k) {
      if (k != batch && !begun_[k]) continue;  // what comes after one that was cancelled does not
      const Status status = world_.engine.wait(*made_[k]).status;
      cancelled += status == Status::cancelled;
      if (status != Status::committed && (status != Status::cancelled || k != whom)) return -1;
      const bool writes = k == writer || k == reserved;
      const auto material = static_cast<std::uint32_t>(world_.material(entities_[k]));
      if (status == Status::committed && writes) {
        if (material != rounds_) return -2;
      } else if (material == rounds_) {
        return -3;
      }
      restarts += made_[k]->outcome().restarts;
    }
    world_.clock.call_at_reading(0, {});
    ++rounds_;
    return cancelled;
  }
  TransactionCounts counts() { return world_.engine.counts(); }

  std::uint64_t restarts = 0;

 private:
  void declare(Who who, const Terms& given, std::uint32_t elements) {
    made_[who]->begin(given);
    if (who == writer || who == reserved) made_[who]->update(entities_[who], row_of(rounds_));
    made_[who]->add_query(*queries_[who], elements);
  }
  void submit(Who who, const Terms& given, std::uint32_t elements) {
    declare(who, given, elements);
    world_.engine.submit(*made_[who]);
    begun_[who] = true;
  }
  void chunk_done(const query::Request& request, std::uint32_t first) {
    if (!reservation_ || first == 0) return;
    if (request.query == queries_[batch].get() && !begun_[writer])
      submit(writer, terms(DeadlineClass::soft, ClockTime::max(), 1), 6 * chunk);
    if (request.query == queries_[writer].get() && !begun_[reserved]) {
      Terms hard = terms(DeadlineClass::hard);
      hard.reservation = reservation_.get();
      submit(reserved, hard, chunk);
      submit(first_reader, terms(DeadlineClass::soft, ClockTime::max(), 2), 100);
      submit(second_reader, terms(DeadlineClass::soft, ClockTime::max(), 2), 100);
    }
  }

  World world_{engine_options(16, 64, 4096)};
  std::vector<std::unique_ptr<SimulatedQuery>> queries_;
  std::vector<std::unique_ptr<Transaction>> made_;
  std::vector<EntityId> entities_;
  std::unique_ptr<Reservation> reservation_;
  std::array<bool, count> begun_{};
  std::uint32_t rounds_ = 1;
};

TEST(CancelEverywhere, LeavesOneOutcomeAndWhatItSays) {
  Scene scene;
  // Every reading of the clock on the way, or some of them.
  constexpr std::uint64_t readings = 90;
  const std::uint64_t scenes = tests::rounds(2 * readings, 100 * readings);
  std::array<std::uint64_t, Scene::count> cancelled{};
  std::array<std::uint64_t, Scene::count> not_cancelled{};
  for (std::size_t whom = 0; whom < Scene::count; ++whom) {
    for (std::uint64_t k = 0; k < scenes; ++k) {
      const auto reading = static_cast<int>(1 + (k * 7) % readings);
      const int found = scene.run(static_cast<Scene::Who>(whom), reading);
      ASSERT_GE(found, 0) << "number " << whom << " at reading " << reading;
      (found > 0 ? cancelled : not_cancelled)[whom]++;
    }
  }
  for (std::size_t whom = 0; whom < Scene::count; ++whom) {
    std::cout << "number " << whom << ": " << cancelled[whom] << " cancelled, " << not_cancelled[whom]
              << " not\n";
    EXPECT_GT(cancelled[whom], scenes / 30);
    EXPECT_GT(not_cancelled[whom], scenes / 30);
  }
  EXPECT_GT(scene.restarts, scenes / 4);
  const TransactionCounts counts = scene.counts();
  EXPECT_EQ(counts.submitted, counts.committed + counts.cancelled);
}

}  // namespace
}  // namespace hil::stress
