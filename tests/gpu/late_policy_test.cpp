// Late policies of queries of each kind: after a missed deadline a query has its last good answers, or the
// answers that were there at the deadline, equal to those of a complete batch.

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <thread>
#include <utility>

#include "tests/gpu/dense_meshes.hpp"
#include "tests/gpu/random_queries.hpp"
#include "tests/gpu/stepping_clock.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t capacity = 24 * 1024;  // six chunks, while the kind has no prediction

class LatePolicies : public DatabaseTest {
 protected:
  void SetUp() override { fill({.clock = &clock_}); }
  void fill(const DatabaseOptions& options) {
    open(options);
    Random random(17);
    const GeometryId body = DatabaseTest::add(make_sphere(1.0, 1));
    std::vector<EntityRow> rows;
    for (int k = 0; k < 300; ++k)
      rows.push_back(row_of(body, 15.0 * random.vector()));
    ids_ = create(rows);
    for (std::uint32_t k = 0; k < capacity; ++k)
      rays_.push_back(ray_from(glm::vec3(15.0 * random.vector()), glm::vec3(random.direction())));
  }
  void TearDown() override {
    all_.clear();
    DatabaseTest::TearDown();
  }

  /// A filled query of each kind; the first has rays.
  void prepare_all(LatePolicy late) {
    all_.clear();
    const auto entities = database().snapshot({}).value();
    const VersionInfo latest = database().latest();
    for (const AnyQueryOptions& options : one_option_per_kind()) {
      all_.push_back(prepare_case(database(), with(options, capacity, late)));
      Random random(18);
      all_.back()->fill(random,
                        {entities, {.radius_m = 15.0, .version_time = latest.time}, latest.time, 0.0});
    }
    std::ranges::copy(rays_, dynamic_cast<RayQuery&>(all_.front()->query()).rays().begin());
  }
  Outcome run_with(KindCase& prepared, const Terms& terms, std::uint32_t count = capacity) {
    const auto transaction = database().make_transaction({.max_queries = 1});
    transaction->begin(terms);
    transaction->add_query(prepared.query(), count);
    return database().execute(*transaction);
  }
  Terms firm(Nanoseconds deadline) const {
    return {.deadline_class = DeadlineClass::firm, .deadline = clock_.now() + deadline, .read_at = {}};
  }

  SteppingClock clock_{Nanoseconds(100'000), false};
  std::vector<EntityId> ids_;
  std::vector<Ray> rays_;
  std::vector<std::unique_ptr<KindCase>> all_;
};

TEST_F(LatePolicies, GivePartialAnswersEqualToThoseOfCompleteBatches) {
  prepare_all(LatePolicy::partial);
  for (const auto& prepared : all_) {
    if (prepared->is_answered_whole()) continue;
    SCOPED_TRACE(prepared->name());
    // How often the clock is read before the first preemption point depends on how long the device takes.
    Outcome partial;
    for (int readings = 18; !partial.partial; readings += 6) {
      ASSERT_LT(readings, 1000);
      partial = run_with(*prepared, firm(Nanoseconds(readings * 100'000)));
      ASSERT_TRUE(partial.partial || partial.status == Status::missed) << describe(partial);
      ASSERT_TRUE(partial.partial || prepared->words().empty()) << "partial answers without the flag";
    }
    const AnswerInfo info = prepared->query().answer_info();
    const std::vector<Words> some = prepared->words();
    ASSERT_EQ(some.size(), capacity);
    EXPECT_GT(info.missing, 0u);
    EXPECT_LT(info.missing, capacity);
    EXPECT_EQ(static_cast<std::uint32_t>(std::ranges::count_if(some, is_incomplete)), info.missing);
    EXPECT_EQ(info.version, database().latest().version);
    EXPECT_TRUE(run_with(*prepared, {}).done());
    const std::vector<Words> complete = prepared->words();
    EXPECT_EQ(prepared->query().answer_info().missing, 0u);
    std::uint32_t different = 0;
    for (std::uint32_t k = 0; k < capacity; ++k)
      different += !is_incomplete(some[k]) && some[k] != complete[k];
    EXPECT_EQ(different, 0u);
  }
}

TEST_F(LatePolicies, GiveNoAnswersOfABatchThatIsAnsweredWhole) {
  prepare_all(LatePolicy::partial);
  for (const auto& prepared : all_) {
    if (!prepared->is_answered_whole()) continue;
    SCOPED_TRACE(prepared->name());
    const Outcome outcome = run_with(*prepared, firm(Nanoseconds(18 * 100'000)));
    EXPECT_FALSE(outcome.done() && !outcome.partial) << "the deadline should have passed";
    for (const Words& words : prepared->words())
      EXPECT_TRUE(is_incomplete(words));
    EXPECT_TRUE(run_with(*prepared, {}).done());
    EXPECT_EQ(prepared->query().answer_info().missing, 0u);
  }
}

/// Long rays continue in retry passes. A deadline between two of them leaves the incomplete rays without an
/// answer, and counts them.
TEST_F(LatePolicies, CountRaysThatTheDeadlineLeavesIncompleteAsMissing) {
  EntityRow dense = row_of(DatabaseTest::add(repeated_triangle(100'000)));
  dense.scale = glm::dvec3(1.0);
  create(dense);
  prepare_all(LatePolicy::partial);
  KindCase& rays = *all_.front();
  EXPECT_EQ(run_with(rays, {}).status, Status::committed);
  const std::vector<Words> complete = rays.words();
  EXPECT_EQ(std::ranges::count_if(complete, is_incomplete), 0);
  EXPECT_EQ(rays.query().answer_info().missing, 0u);
  std::uint32_t fewest = capacity;
  bool missed_in_retries = false;
  for (int steps = 20; fewest > 0; steps += steps / 3) {
    ASSERT_LT(steps, 100'000);
    const Outcome outcome = run_with(rays, firm(Nanoseconds(steps * 100'000)));
    if (outcome.status == Status::missed && !outcome.partial) continue;
    const std::vector<Words> some = rays.words();
    const std::uint32_t missing = rays.query().answer_info().missing;
    EXPECT_EQ(static_cast<std::uint32_t>(std::ranges::count_if(some, is_incomplete)), missing)
        << describe(outcome);
    EXPECT_EQ(outcome.partial, missing > 0) << describe(outcome);
    for (std::uint32_t k = 0; k < capacity; ++k)
      ASSERT_TRUE(is_incomplete(some[k]) || some[k] == complete[k]) << "ray " << k;
    // All elements of the first pass are complete.
    missed_in_retries = missed_in_retries || (missing > 0 && missing < capacity / 10);
    fewest = std::min(fewest, missing);
  }
  EXPECT_TRUE(missed_in_retries);
}

/// At one of its readings on the engine thread it calls a function that submits transactions; when they are
/// complete, hardly any time is left to the deadline.
class InterruptingClock final : public Clock {
 public:
  ClockTime now() const noexcept override {
    if (std::this_thread::get_id() != test_ && armed_ && --readings_ == 0) at_reading();
    if (armed_ && late()) return clock_time_ns(deadline_ns_ - 2'000 + 10 * ++late_readings_);
    return clock_time_ns(now_ns_.fetch_add(1'000, std::memory_order_relaxed));
  }
  /// Returns the deadline of the interrupted transaction.
  ClockTime arm(int reading) {
    late_readings_ = 0;
    readings_ = reading;
    deadline_ns_ = now_ns_ + 1'000'000'000;
    armed_ = true;
    return clock_time_ns(deadline_ns_);
  }
  void disarm() {
    now_ns_ = deadline_ns_.load();
    armed_ = false;
  }
  std::function<void()> at_reading = [] {};
  std::function<bool()> late = [] { return false; };

 private:
  const std::thread::id test_ = std::this_thread::get_id();
  mutable std::atomic<std::int64_t> now_ns_{1'000'000'000};
  std::atomic<std::int64_t> deadline_ns_{0};
  mutable std::atomic<int> late_readings_{0}, readings_{0};
  std::atomic<bool> armed_{false};
};

class PartialAnswers : public LatePolicies {
 protected:
  void SetUp() override { fill({.clock = &interrupting_}); }
  InterruptingClock interrupting_;
};

/// Nested transactions remove an entity and create another at its index, at a preemption point of a query
/// that ends there.
TEST_F(PartialAnswers, NameTheEntitiesOfTheirVersion) {
  prepare_all(LatePolicy::partial);
  KindCase& regions = **std::ranges::find_if(all_, [](const auto& prepared) {
    return dynamic_cast<const RegionQuery*>(&prepared->query()) != nullptr;
  });
  const auto* query = dynamic_cast<const RegionQuery*>(&regions.query());
  const auto rays = prepare_rays(RayMode::closest, false, 64);
  std::ranges::copy(std::span(rays_).first(64), rays->rays().begin());
  const auto removes = database().make_transaction({.max_writes = 1});
  const auto creates = database().make_transaction({.max_writes = 1, .max_queries = 1});
  std::size_t interrupted = 0;
  for (int reading = 1; reading < 40; ++reading) {
    const auto k = static_cast<std::size_t>(reading);
    std::vector<EntityId> before(capacity);
    const auto entities = database().snapshot({}).value();
    for (const EntityState& state : entities)
      before[state.id.index] = state.id;
    Terms higher;
    higher.importance = 1;
    std::atomic<bool> submitted = false;
    interrupting_.at_reading = [&] {
      removes->begin(higher);
      removes->remove(ids_[k]);
      database().submit(*removes);
      creates->begin(higher);
      creates->create(row_of(GeometryId{0}, glm::dvec3(rays_[k].origin_m)));
      creates->add_query(*rays, 64);
      database().submit(*creates);
      submitted = true;
    };
    interrupting_.late = [&] { return submitted && creates->status() == Status::committed; };
    const ClockTime deadline = interrupting_.arm(reading);
    const Outcome outcome =
        run_with(regions, {.deadline_class = DeadlineClass::firm, .deadline = deadline, .read_at = {}});
    interrupting_.disarm();
    interrupting_.late = [] { return false; };
    if (!submitted) continue;
    ASSERT_EQ(database().wait(*creates).status, Status::committed);
    ids_[k] = creates->created(0);
    if (!outcome.partial) continue;
    ++interrupted;
    std::size_t wrong = 0;
    for (const RegionAnswer& answer : query->answers()) {
      for (const EntityId id : answer.entities)
        wrong += before[id.index] != id ? 1 : 0;
    }
    EXPECT_EQ(wrong, 0u) << "interrupted at reading " << reading;
  }
  EXPECT_GT(interrupted, 0u);
}

TEST_F(LatePolicies, KeepTheLastGoodAnswersOfAMissedTransaction) {
  prepare_all(LatePolicy::last_good);
  const Version first = database().latest().version;
  std::vector<std::vector<Words>> before;
  for (const auto& prepared : all_) {
    ASSERT_TRUE(run_with(*prepared, {}).done());
    before.push_back(prepared->words());
  }
  for (std::size_t k = 0; k < ids_.size(); k += 10)
    update_motion(ids_[k], {.p_world_m = {1.0, 2.0, 3.0}}, {});
  for (std::size_t k = 0; k < all_.size(); ++k) {
    SCOPED_TRACE(all_[k]->name());
    // The device has written answers, but they are not published in time.
    Outcome missed;
    for (int steps = 2; missed.computed == ClockTime{} || missed.done(); ++steps) {
      ASSERT_LT(steps, 60);
      missed = run_with(*all_[k], firm(Nanoseconds(steps * 100'000)));
      if (!missed.done()) continue;
      steps = 2;
      before[k] = all_[k]->words();
    }
    EXPECT_EQ(missed.status, Status::missed);
    EXPECT_TRUE(missed.stale);
    EXPECT_EQ(all_[k]->words(), before[k]);
    const AnswerInfo& info = all_[k]->query().answer_info();
    EXPECT_TRUE(info.stale);
    EXPECT_GE(info.version, first);
    EXPECT_GT(info.age.count(), 0);
  }
}

}  // namespace
}  // namespace rtstdb::test
