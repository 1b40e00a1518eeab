// Chunks that are halted since they take longer than predicted while a transaction of higher priority waits:
// their answers are those of complete runs. On the executor, so that each chunk is halted.

#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>
#include <variant>
#include <vector>

#include "tests/gpu/dense_meshes.hpp"
#include "tests/gpu/executor_fixture.hpp"
#include "tests/gpu/kind_cases.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t max_elements = 2'000;
/// Elements of expensive kinds: enough for some to begin after a halt.
constexpr std::uint32_t few_elements = 100;
constexpr std::uint32_t few_images = 20;
/// On a busy machine all elements of a batch may have begun before this thread runs again.
constexpr int attempts = 500;

class HaltedRuns : public ExecutorTest {
 protected:
  struct Batch {
    std::shared_ptr<KindCase> query;
    std::uint32_t count = 0;
    std::vector<Words> answers() const { return query->words(); }
    query::PreparedQuery& prepared() const { return query->prepared(); }
  };

  /// With few entities there is no work sharing.
  void make_world(std::uint32_t entities) {
    Random random(71);
    std::vector<GeometryId> geometries;
    for (const TriangleMesh& mesh : mixed_meshes(random))
      geometries.push_back(add(mesh));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < entities; ++i) {
      rows.push_back(random_row(random, geometries, scene, rows));
      states_.push_back({.id = {i, 1}, .row = rows.back(), .written_by = 1});
    }
  }

  Batch prepare(const AnyQueryOptions& options, std::uint32_t count, double window_s = 0.2) {
    Batch batch{prepare_case(*executor_, with(options, max_elements)), count};
    Random random(72);
    batch.query->fill(random, {states_, scene, scene.version_time, window_s});
    return batch;
  }
  Batch packets(const RayQueryOptions& options, double window_s) {
    Batch batch = prepare(options, max_elements - 3);
    Random random(72);
    fill_with_neighbours(dynamic_cast<RayQuery&>(batch.query->query()).rays(), random, states_, scene,
                         scene.version_time, window_s);
    return batch;
  }
  static std::uint32_t count_of(const AnyQueryOptions& options) {
    if (std::holds_alternative<ImageQueryOptions>(options)) return few_images;
    return is_expensive(options) ? few_elements : max_elements;
  }
  /// Rays also at one instant and as packets.
  std::vector<Batch> all_kinds(bool with_all_options = true) {
    std::vector<Batch> all;
    for (const AnyQueryOptions& options : with_all_options ? all_tested_options() : one_option_per_kind())
      all.push_back(prepare(options, count_of(options) - 1));
    for (const RayMode mode : {RayMode::closest, RayMode::any}) {
      all.push_back(prepare(RayQueryOptions{.name = "rays at one instant", .mode = mode}, max_elements, 0.0));
      for (const double window_s : {0.0, 0.2})
        all.push_back(packets({.name = "packets", .mode = mode}, window_s));
    }
    return all;
  }

  query::RunStatus run(std::span<const Batch> all, query::ExecutorCallbacks* callbacks,
                       std::uint32_t per_chunk = 0) {
    const FixedRows rows(states_);
    store::TimeSpan times;
    std::vector<query::Request> requests;
    for (const Batch& batch : all) {
      query::TimeSpan batch_times;
      EXPECT_FALSE(batch.prepared().check(batch.count, rows, batch_times));
      times = {std::min(times.first, batch_times.first), std::max(times.last, batch_times.last)};
      requests.push_back({.query = &batch.prepared(),
                          .count = batch.count,
                          .times = batch_times,
                          .per_chunk = per_chunk,
                          .chunk_time = chunk_time_});
    }
    const query::RunReport report = executor_->run(rows, requests, times, callbacks);
    gpu_ns_ = report.gpu_ns;
    for (const Batch& batch : all)
      batch.prepared().publish_answers(batch.prepared().answered(), batch.count);
    return report.status;
  }
  static std::vector<std::vector<Words>> answers_of(std::span<const Batch> all) {
    std::vector<std::vector<Words>> answers;
    for (const Batch& batch : all)
      answers.push_back(batch.answers());
    return answers;
  }
  void expect_same(std::span<const Batch> all, const std::vector<std::vector<Words>>& complete) {
    for (std::size_t k = 0; k < all.size(); ++k)
      EXPECT_TRUE(have_equal_answers(all[k].answers(), complete[k])) << all[k].query->name();
  }
  void run_at_another_version(const Batch& batch, query::ExecutorCallbacks* callbacks = nullptr) {
    constexpr std::uint32_t few = 64;
    const FixedRows other_version(states_, 2);
    store::TimeSpan times;
    const query::Request request{.query = &batch.prepared(), .count = few};
    EXPECT_FALSE(batch.prepared().check(few, other_version, times));
    executor_->run(other_version, std::span(&request, 1), times, callbacks);
  }
  bool can_halt() const { return executor_->device_info().software; }

  static constexpr SceneOptions scene{.radius_m = 12.0,
                                      .version_time = WorldTime(Nanoseconds(5'000'000'000))};
  std::vector<EntityState> states_;
  Nanoseconds chunk_time_{10'000};
  std::int64_t gpu_ns_ = 0;  // of the last run
};

TEST_F(HaltedRuns, AnswerAsCompleteRuns) {
  for (const std::uint32_t entities : {12u, 300u}) {
    SCOPED_TRACE(entities);
    SetUp();
    states_.clear();
    make_world(entities);
    const auto all = all_kinds(entities == 12);
    for (const Batch& batch : all)
      run(std::span(&batch, 1), nullptr);
    const auto complete = answers_of(all);
    for (std::size_t k = 0; k < all.size(); ++k) {
      PreemptionPoints points;
      points.requested = true;
      // First after some elements have begun, then at once: each retry gets more time. All elements may have
      // begun before.
      for (int attempt = 0; attempt < 2 || (attempt < attempts && points.count == 0 && can_halt());
           ++attempt) {
        chunk_time_ = Nanoseconds(attempt == 0 ? 10'000 : 1);
        run(std::span(&all[k], 1), &points);
        EXPECT_TRUE(have_equal_answers(all[k].answers(), complete[k])) << "query " << k;
      }
      EXPECT_EQ(points.count > 0, can_halt()) << "query " << k;
    }
  }
}

/// A chunk has parts of several batches and is halted in any of them.
TEST_F(HaltedRuns, AnswerAsCompleteRunsWithSeveralBatchesInAChunk) {
  make_world(300);
  const auto all = all_kinds();
  run(all, nullptr);
  const auto complete = answers_of(all);
  for (const std::uint32_t per_chunk : {0u, 700u}) {
    PreemptionPoints points;
    points.requested = true;
    run(all, &points, per_chunk);
    EXPECT_TRUE(points.count > 0 || !can_halt());
    expect_same(all, complete);
  }
}

/// A nested run at another version takes the slot of the halted run.
TEST_F(HaltedRuns, AnswerAsCompleteRunsWithNestedRuns) {
  make_world(300);
  const auto all = all_kinds();
  run(all, nullptr);
  const auto complete = answers_of(all);
  const Batch nested = prepare(RayQueryOptions{.name = "nested"}, max_elements, 0.0);
  PreemptionPoints points([&] { run_at_another_version(nested); });
  points.requested = true;
  run(all, &points, 500);
  EXPECT_GT(points.count, 0);
  expect_same(all, complete);
}

/// Two chunks are in flight: a nested run after the first waits only for the elements of the second that have
/// begun. Real time is the subject: the wait is compared with the time of a chunk.
TEST_F(HaltedRuns, EndEarlyForNestedRuns) {
  class DrainTimes final : public query::ExecutorCallbacks {
   public:
    void begin_wait() noexcept override {}
    void end_wait() noexcept override {}
    void begin_drain() noexcept override { began_ = std::chrono::steady_clock::now(); }
    void end_drain() noexcept override {
      shortest = std::min<Nanoseconds>(shortest, std::chrono::steady_clock::now() - began_);
    }
    Continuation on_preemption_point() noexcept override { return Continuation::go_on; }
    Nanoseconds shortest = Nanoseconds::max();

   private:
    std::chrono::steady_clock::time_point began_;
  };
  make_world(300);
  const std::vector<Batch> large{
      prepare(NearestQueryOptions{.name = "large", .target = NearestTarget::triangle, .k = 9}, max_elements)};
  chunk_time_ = std::chrono::hours(1);  // no chunk takes longer than predicted
  constexpr std::uint32_t chunks = 5;
  PreemptionPoints undisturbed;
  const auto begin = std::chrono::steady_clock::now();
  run(large, &undisturbed, max_elements / chunks);
  const Nanoseconds one_chunk = (std::chrono::steady_clock::now() - begin) / chunks;
  EXPECT_EQ(undisturbed.count, chunks - 1);
  const auto complete = answers_of(large);
  const Batch nested = prepare(RayQueryOptions{.name = "nested"}, max_elements, 0.0);
  DrainTimes drains;
  PreemptionPoints points([&] { run_at_another_version(nested, &drains); });
  run(large, &points, max_elements / chunks);
  EXPECT_GT(points.count, 0);
  if (can_halt()) {
    EXPECT_LT(drains.shortest, one_chunk / 4);
  }
  expect_same(large, complete);
}

/// Signs are counted in a second dispatch, so that a chunk that is halted at once has no answers. A chunk
/// whose results would cost much device time completes instead. Real time is the subject: the device times
/// are compared.
TEST_F(HaltedRuns, DiscardLittleForNestedRuns) {
  make_world(300);
  const std::vector<Batch> large{prepare(
      NearestQueryOptions{.name = "signed", .target = NearestTarget::surface, .k = 3, .is_signed = true},
      max_elements)};
  chunk_time_ = std::chrono::hours(1);
  constexpr std::uint32_t per_chunk = 16;  // all elements begin at once
  const Batch nested = prepare(RayQueryOptions{.name = "nested"}, max_elements, 0.0);
  PreemptionPoints undisturbed, disturbed([&] { run_at_another_version(nested); });
  std::int64_t undisturbed_ns = std::numeric_limits<std::int64_t>::max(), disturbed_ns = undisturbed_ns;
  for (int k = 0; k < 5; ++k) {
    run(large, &undisturbed, per_chunk);
    undisturbed_ns = std::min(undisturbed_ns, gpu_ns_);
    run(large, &disturbed, per_chunk);
    disturbed_ns = std::min(disturbed_ns, gpu_ns_);
  }
  EXPECT_GT(disturbed.count, 100);
  EXPECT_LT(static_cast<double>(disturbed_ns), 1.8 * static_cast<double>(undisturbed_ns));
}

/// A run that ends with the chunk in flight has the answers of a complete run to its first elements.
TEST_F(HaltedRuns, AnswerTheFirstElementsIfThePreemptionPointEndsThem) {
  make_world(300);
  for (const Batch& batch : all_kinds()) {
    run(std::span(&batch, 1), nullptr);
    const auto complete = batch.answers();
    PreemptionPoints points;
    points.requested = true;
    points.continuation = PreemptionPoints::Continuation::finish_in_flight;
    query::RunStatus status = query::RunStatus::done;
    for (int attempt = 0; attempt < attempts && batch.prepared().answered() == batch.count; ++attempt) {
      chunk_time_ = Nanoseconds(attempt == 0 ? 10'000 : 1);
      status = run(std::span(&batch, 1), &points);
    }
    const std::uint32_t answered = batch.prepared().answered();
    EXPECT_EQ(answered < batch.count, can_halt());
    if (can_halt()) {
      EXPECT_EQ(status, query::RunStatus::partial);
    }
    std::size_t missing = 0;
    const auto now = batch.answers();
    ASSERT_EQ(now.size(), complete.size());
    for (std::size_t i = 0; i < now.size(); ++i) {
      const bool is_missing = is_incomplete(now[i]);
      missing += is_missing ? 1 : 0;
      EXPECT_TRUE(is_missing || now[i] == complete[i]) << "element " << i;
    }
    const std::uint32_t unanswered = batch.count - answered + batch.prepared().incomplete(answered);
    EXPECT_EQ(missing, unanswered * (now.size() / batch.count));
  }
}

/// The first pass leaves elements incomplete: at dense meshes, where signs are counted, and with short lists.
/// Each is retried alone in its group.
TEST_F(HaltedRuns, AnswerAsCompleteRunsInRetryPasses) {
  make_world(12);
  double height_m = 20.0;
  for (const TriangleMesh& mesh :
       {repeated_triangle(100'000), repeated_triangle(30'000), stacked_prisms(9'000)}) {
    const EntityRow row = row_of(add(mesh), {0.0, 0.0, height_m});
    height_m += 10.0;
    states_.push_back({.id = {static_cast<std::uint32_t>(states_.size()), 1}, .row = row, .written_by = 1});
  }
  constexpr std::uint32_t count = 40;
  const auto place = [&](auto elements, auto set) {
    for (std::size_t i = 0; i < elements.size(); ++i)
      set(elements[i],
          glm::vec3(0.01f * static_cast<float>(i % 8), 0.02f, 19.99f + 10.0f * static_cast<float>(i % 3)));
  };
  std::vector<Batch> all;
  for (const std::uint32_t ids : {0u, 4u}) {
    all.push_back(prepare(
        RegionQueryOptions{.name = "regions", .level = RegionLevel::triangle, .ids_per_region = ids}, count));
    place(dynamic_cast<RegionQuery&>(all.back().query->query()).regions(), [](Region& region, glm::vec3 p_m) {
      region = {};
      region.center_m = p_m;
      region.half_extent_m = glm::vec3(0.5f);
      region.t = scene.version_time;
    });
  }
  all.push_back(prepare(
      NearestQueryOptions{.name = "signed", .target = NearestTarget::surface, .k = 1, .is_signed = true},
      count));
  place(dynamic_cast<NearestQuery&>(all.back().query->query()).points(), [](Nearest& point, glm::vec3 p_m) {
    point = {};
    point.point_m = p_m;
    point.t = scene.version_time;
  });
  for (const Batch& batch : all) {
    PreemptionPoints before_each_pass;
    run(std::span(&batch, 1), &before_each_pass);
    EXPECT_EQ(before_each_pass.count, 1) << "no retry: " << batch.query->name();
  }
  const auto complete = answers_of(all);
  for (std::size_t k = 0; k < all.size(); ++k) {
    PreemptionPoints points;
    points.requested = true;
    run(std::span(&all[k], 1), &points);
    EXPECT_EQ(all[k].answers(), complete[k]) << "query " << k;
    EXPECT_TRUE(points.count > 1 || !can_halt()) << "query " << k;
  }
}

TEST_F(HaltedRuns, AreNotHaltedWithoutARequest) {
  make_world(300);
  PreemptionPoints points;
  run(std::vector{prepare(RayQueryOptions{.name = "rays"}, max_elements)}, &points);
  EXPECT_EQ(points.count, 0);
}

}  // namespace
}  // namespace rtstdb::test
