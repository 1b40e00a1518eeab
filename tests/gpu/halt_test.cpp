// Chunks that are halted, since they take longer than was thought and somebody waits: what they answer. On
// the executor itself, so that every one is.

#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>
#include <vector>

#include "rtstdb/query/gpu_executor.hpp"
#include "tests/gpu/dense_meshes.hpp"
#include "tests/gpu/gaps.hpp"
#include "tests/gpu/gpu_test.hpp"
#include "tests/gpu/kind_cases.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t most = 2'000;
/// Where others use the processors, all of a batch have begun before this thread may look again.
constexpr int attempts = 500;

class HaltedRuns : public testing::Test {
 protected:
  struct Asked {
    std::shared_ptr<KindCase> query;
    std::uint32_t count = 0;
    std::vector<Words> answers() const { return query->words(); }
    query::PreparedQuery& prepared() const { return query->prepared(); }
  };

  void SetUp() override {
    auto created = query::GpuExecutor::create(
        [](const std::vector<std::byte>&) { return gpu::Device::open(gpu::test::shared_device_options()); },
        {});
    ASSERT_TRUE(created.ok()) << created.error().message;
    executor_ = std::move(created).value();
  }
  void TearDown() override {
    for (const std::string& message : executor_->device_health().validation_messages)
      ADD_FAILURE() << "validation layer: " << message;
  }

  /// With few of them rays are searched by a lane alone, with many by crews.
  void make_world(std::uint32_t entities) {
    Random random(71);
    std::vector<GeometryId> geometries;
    for (const TriangleMesh& mesh : mixed_meshes(random)) {
      auto added = executor_->add_geometry(std::make_shared<TriangleMesh>(mesh), {});
      ASSERT_TRUE(added.ok());
      geometries.push_back(added.value());
    }
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < entities; ++i) {
      rows.push_back(random_row(random, geometries, scene, rows));
      states_.push_back({.id = {i, 1}, .row = rows.back(), .written_by = 1});
    }
  }
  OneWorld world() const { return {states_, 1, 0, {}}; }

  Asked prepare(const AnyQueryOptions& options, std::uint32_t count) {
    Asked asked{prepare_case(*executor_, with(options, most)), count};
    Random random(72);
    asked.query->fill(random, {states_, scene, scene.version_time, 0.2});
    return asked;
  }
  Asked rays(const RayQueryOptions& options, double window_s) {
    Asked asked = prepare(options, most);
    Random random(72);
    asked.query->fill(random, {states_, scene, scene.version_time, window_s});
    return asked;
  }
  Asked neighbours(const RayQueryOptions& options, double window_s) {
    Asked asked = prepare(options, most - 3);
    const auto rays = dynamic_cast<RayQuery&>(asked.query->query()).rays();
    Random random(72);
    for (std::size_t i = 0; i < most; i += 8) {
      const auto eight = random_neighbours(random, states_, scene, scene.version_time, window_s);
      std::ranges::copy(eight, rays.begin() + static_cast<std::ptrdiff_t>(i));
    }
    return asked;
  }
  /// Of rays also those at one instant, and those that run side by side.
  std::vector<Asked> all_kinds() {
    std::vector<Asked> all;
    for (const AnyQueryOptions& options : options_of_every_kind())
      all.push_back(prepare(options, most - 1));
    for (const RayMode mode : {RayMode::closest, RayMode::any}) {
      all.push_back(rays({.name = "rays at one instant", .mode = mode}, 0.0));
      for (const double window_s : {0.0, 0.2})
        all.push_back(neighbours({.name = "neighbours", .mode = mode}, window_s));
    }
    return all;
  }

  query::RunStatus run(std::span<const Asked> all, query::ExecutorCallbacks* callbacks,
                       std::uint32_t per_chunk = 0) {
    const OneWorld rows = world();
    store::TimeSpan times;
    std::vector<query::Request> requests;
    for (const Asked& one : all) {
      query::TimeSpan of_one;
      EXPECT_FALSE(one.prepared().check(one.count, rows, of_one));
      times = {std::min(times.first, of_one.first), std::max(times.last, of_one.last)};
      requests.push_back({.query = &one.prepared(),
                          .count = one.count,
                          .times = of_one,
                          .per_chunk = per_chunk,
                          .chunk_time = chunk_time_});
    }
    const query::RunReport report = executor_->run(rows, requests, times, callbacks);
    gpu_ns_ = report.gpu_ns;
    for (const Asked& one : all)
      one.prepared().publish_answers(one.prepared().answered(), one.count);
    return report.status;
  }
  static std::vector<std::vector<Words>> answers_of(std::span<const Asked> all) {
    std::vector<std::vector<Words>> answers;
    for (const Asked& one : all)
      answers.push_back(one.answers());
    return answers;
  }
  void expect_same(std::span<const Asked> all, const std::vector<std::vector<Words>>& whole) {
    for (std::size_t k = 0; k < all.size(); ++k)
      EXPECT_TRUE(same(all[k].answers(), whole[k])) << "query " << k;
  }
  void run_at_another_version(const Asked& one, query::ExecutorCallbacks* callbacks = nullptr) {
    constexpr std::uint32_t few = 64;
    const OneWorld other_world(states_, 2, 0, {});
    store::TimeSpan times;
    const query::Request request{.query = &one.prepared(), .count = few};
    EXPECT_FALSE(one.prepared().check(few, other_world, times));
    executor_->run(other_world, std::span(&request, 1), times, callbacks);
  }
  bool can_halt() const { return executor_->device_info().software; }

  static constexpr SceneOptions scene{.radius_m = 12.0,
                                      .version_time = WorldTime(Nanoseconds(5'000'000'000))};
  std::unique_ptr<query::GpuExecutor> executor_;
  std::vector<EntityState> states_;
  Nanoseconds chunk_time_{10'000};
  std::int64_t gpu_ns_ = 0;  // of the last run
};

TEST_F(HaltedRuns, AnswerAsWholeOnes) {
  for (const std::uint32_t entities : {12u, 300u}) {
    SCOPED_TRACE(entities);
    SetUp();
    states_.clear();
    make_world(entities);
    const auto all = all_kinds();
    for (const Asked& one : all)
      run(std::span(&one, 1), nullptr);
    const auto whole = answers_of(all);
    for (std::size_t k = 0; k < all.size(); ++k) {
      Gaps gaps([] {});
      gaps.awaited = true;
      // Soon, when some have begun; and at once, when none has: then it gets more time each time. All may
      // have begun before.
      for (int attempt = 0; attempt < 2 || (attempt < attempts && gaps.count == 0 && can_halt()); ++attempt) {
        chunk_time_ = Nanoseconds(attempt == 0 ? 10'000 : 1);
        run(std::span(&all[k], 1), &gaps);
        EXPECT_TRUE(same(all[k].answers(), whole[k])) << "query " << k;
      }
      EXPECT_EQ(gaps.count > 0, can_halt()) << "query " << k;
    }
  }
}

/// One chunk goes through several batches, and is halted in any of them.
TEST_F(HaltedRuns, AnswerAsWholeOnesWhereSeveralBatchesAreInAChunk) {
  make_world(300);
  const auto all = all_kinds();
  run(all, nullptr);
  const auto whole = answers_of(all);
  for (const std::uint32_t per_chunk : {0u, 700u}) {
    Gaps gaps([] {});
    gaps.awaited = true;
    run(all, &gaps, per_chunk);
    EXPECT_TRUE(gaps.count > 0 || !can_halt());
    expect_same(all, whole);
  }
}

/// In the gaps others, at another version, take what the halted one was searched in.
TEST_F(HaltedRuns, AnswerAsWholeOnesWithOthersInTheirGaps) {
  make_world(300);
  const auto all = all_kinds();
  run(all, nullptr);
  const auto whole = answers_of(all);
  const Asked other = rays({.name = "other"}, 0.0);
  Gaps gaps([&] { run_at_another_version(other); });
  gaps.awaited = true;
  run(all, &gaps, 500);
  EXPECT_GT(gaps.count, 0);
  expect_same(all, whole);
}

/// Two are under way: who runs in the gap behind the first waits for no more of the second than it has begun.
TEST_F(HaltedRuns, EndAtOnceForWhoeverRunsInTheirGaps) {
  class Waits final : public query::ExecutorCallbacks {
   public:
    void begin_wait() noexcept override {}
    void end_wait() noexcept override {}
    void begin_drain() noexcept override { began_ = std::chrono::steady_clock::now(); }
    void end_drain() noexcept override {
      least = std::min<Nanoseconds>(least, std::chrono::steady_clock::now() - began_);
    }
    Continuation on_preemption_point() noexcept override { return Continuation::go_on; }
    Nanoseconds least = Nanoseconds::max();

   private:
    std::chrono::steady_clock::time_point began_;
  };
  make_world(300);
  const std::vector<Asked> large{
      prepare(NearestQueryOptions{.name = "large", .target = NearestTarget::triangle, .k = 9}, most)};
  chunk_time_ = std::chrono::hours(1);  // they are never too late
  constexpr std::uint32_t chunks = 5;
  Gaps nobody([] {});
  const auto begin = std::chrono::steady_clock::now();
  run(large, &nobody, most / chunks);
  const Nanoseconds one_chunk = (std::chrono::steady_clock::now() - begin) / chunks;
  EXPECT_EQ(nobody.count, chunks - 1);
  const auto whole = answers_of(large);
  const Asked other = rays({.name = "other"}, 0.0);
  Waits waits;
  Gaps somebody([&] { run_at_another_version(other, &waits); });
  run(large, &somebody, most / chunks);
  EXPECT_GT(somebody.count, 0);
  if (can_halt()) {
    EXPECT_LT(waits.least, one_chunk / 4);
  }
  expect_same(large, whole);
}

/// Signs are found in a second dispatch: of what is halted at once nothing stands. Where that would take much
/// of the device's time, it is let finish.
TEST_F(HaltedRuns, ThrowLittleAwayForOthers) {
  make_world(300);
  const std::vector<Asked> large{prepare(
      NearestQueryOptions{.name = "signed", .target = NearestTarget::surface, .k = 3, .is_signed = true},
      most)};
  chunk_time_ = std::chrono::hours(1);
  constexpr std::uint32_t per_chunk = 16;  // all of them begin at once
  const Asked other = rays({.name = "other"}, 0.0);
  Gaps nobody([] {}), somebody([&] { run_at_another_version(other); });
  std::int64_t undisturbed_ns = std::numeric_limits<std::int64_t>::max(), disturbed_ns = undisturbed_ns;
  for (int k = 0; k < 5; ++k) {
    run(large, &nobody, per_chunk);
    undisturbed_ns = std::min(undisturbed_ns, gpu_ns_);
    run(large, &somebody, per_chunk);
    disturbed_ns = std::min(disturbed_ns, gpu_ns_);
  }
  EXPECT_GT(somebody.count, 100);
  EXPECT_LT(static_cast<double>(disturbed_ns), 1.8 * static_cast<double>(undisturbed_ns));
}

/// What stands when a run ends early is the beginning of what the whole one answers.
TEST_F(HaltedRuns, AnswerTheBeginningWhereAGapSaysEnough) {
  make_world(300);
  class Enough final : public query::ExecutorCallbacks {
   public:
    void begin_wait() noexcept override {}
    void end_wait() noexcept override {}
    bool preemption_requested() noexcept override { return true; }
    Continuation on_preemption_point() noexcept override { return Continuation::finish_in_flight; }
  };
  for (const Asked& one : all_kinds()) {
    run(std::span(&one, 1), nullptr);
    const auto whole = one.answers();
    Enough enough;
    query::RunStatus status = query::RunStatus::done;
    for (int attempt = 0; attempt < attempts && one.prepared().answered() == one.count; ++attempt) {
      chunk_time_ = Nanoseconds(attempt == 0 ? 10'000 : 1);
      status = run(std::span(&one, 1), &enough);
    }
    const std::uint32_t answered = one.prepared().answered();
    EXPECT_EQ(answered < one.count, can_halt());
    if (can_halt()) {
      EXPECT_EQ(status, query::RunStatus::partial);
    }
    std::size_t missing = 0;
    const auto now = one.answers();
    ASSERT_EQ(now.size(), whole.size());
    for (std::size_t i = 0; i < now.size(); ++i) {
      const bool is_missing = is_incomplete(now[i]);
      missing += is_missing ? 1 : 0;
      EXPECT_TRUE(is_missing || now[i] == whole[i]) << "element " << i;
    }
    const std::uint32_t unanswered = one.count - answered + one.prepared().incomplete(answered);
    EXPECT_EQ(missing, unanswered * (now.size() / one.count));
  }
}

/// Each alone in a group, at piles in which eight together came to no end, a tower where signs are counted,
/// and with lists too short.
TEST_F(HaltedRuns, AnswerAsWholeOnesWhereTheyAreAskedAgain) {
  make_world(12);
  double height_m = 20.0;
  for (const TriangleMesh& mesh : {repeated_triangle(100'000), repeated_triangle(30'000), stacked_prisms(9'000)}) {
    auto added = executor_->add_geometry(std::make_shared<TriangleMesh>(mesh), {});
    ASSERT_TRUE(added.ok());
    const EntityRow row = row_of(added.value(), {0.0, 0.0, height_m});
    height_m += 10.0;
    states_.push_back({.id = {static_cast<std::uint32_t>(states_.size()), 1}, .row = row, .written_by = 1});
  }
  constexpr std::uint32_t asked = 40;
  const auto heaped = [&](auto element, auto at) {
    for (std::size_t i = 0; i < element.size(); ++i)
      at(element[i],
         glm::vec3(0.01f * static_cast<float>(i % 8), 0.02f, 19.99f + 10.0f * static_cast<float>(i % 3)));
  };
  std::vector<Asked> all;
  for (const std::uint32_t ids : {0u, 4u}) {
    all.push_back(prepare(
        RegionQueryOptions{.name = "regions", .level = RegionLevel::triangle, .ids_per_region = ids}, asked));
    heaped(dynamic_cast<RegionQuery&>(all.back().query->query()).regions(),
           [](Region& region, glm::vec3 p_m) {
             region = {};
             region.center_m = p_m;
             region.half_extent_m = glm::vec3(0.5f);
             region.t = scene.version_time;
           });
  }
  all.push_back(prepare(
      NearestQueryOptions{.name = "signed", .target = NearestTarget::surface, .k = 1, .is_signed = true},
      asked));
  heaped(dynamic_cast<NearestQuery&>(all.back().query->query()).points(), [](Nearest& point, glm::vec3 p_m) {
    point = {};
    point.point_m = p_m;
    point.t = scene.version_time;
  });
  for (const Asked& one : all) {
    Gaps before_each_pass([] {});
    run(std::span(&one, 1), &before_each_pass);
    EXPECT_EQ(before_each_pass.count, 1) << "not asked again: query " << &one - all.data();
  }
  const auto whole = answers_of(all);
  for (std::size_t k = 0; k < all.size(); ++k) {
    Gaps gaps([] {});
    gaps.awaited = true;
    run(std::span(&all[k], 1), &gaps);
    EXPECT_EQ(all[k].answers(), whole[k]) << "query " << k;
    EXPECT_TRUE(gaps.count > 1 || !can_halt()) << "query " << k;
  }
}

TEST_F(HaltedRuns, AreWholeWhereNobodyWaits) {
  make_world(300);
  Gaps gaps([] {});
  run(std::vector{rays({.name = "rays"}, 0.2)}, &gaps);
  EXPECT_EQ(gaps.count, 0);
}

}  // namespace
}  // namespace rtstdb::test
