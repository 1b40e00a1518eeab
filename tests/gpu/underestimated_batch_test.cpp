// Batches of expensive elements after many cheap ones of their kind, which are predicted to take less than a
// chunk: a query of higher priority or a cancellation does not wait for their end. One batch for each
// dispatch that can be long. Real time is the subject: the waits are compared with the time of the batch.

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <thread>
#include <vector>

#include "tests/gpu/dense_meshes.hpp"

namespace rtstdb::test {
namespace {

/// Adds a batch at this height, which is expensive at the mesh.
using AddBatch = std::function<void(Transaction&, float height_m)>;

struct Batch {
  const char* name;
  TriangleMesh (*mesh)();
  AddBatch (*prepare)(Database&);
};

std::ostream& operator<<(std::ostream& out, const Batch& batch) {
  return out << batch.name;
}

constexpr float mesh_m = 50.0f, empty_m = -500.0f;

AddBatch nearest(Database& database, std::uint32_t count, bool is_signed) {
  const std::shared_ptr<NearestQuery> query =
      database.prepare(NearestQueryOptions{.name = "short", .capacity = count, .is_signed = is_signed})
          .value();
  return [query, count](Transaction& transaction, float height_m) {
    for (Nearest& point : query->points()) {
      point.point_m = {0.01f, 0.02f, height_m - 0.01f};
      point.radius_m = 5.0f;
      point.t = at_s(5.1);
    }
    transaction.add_query(*query, count);
  };
}

AddBatch regions(Database& database, std::uint32_t count, std::uint32_t ids) {
  const std::shared_ptr<RegionQuery> query =
      database
          .prepare(RegionQueryOptions{
              .name = "short", .capacity = count, .level = RegionLevel::triangle, .ids_per_region = ids})
          .value();
  return [query, count](Transaction& transaction, float height_m) {
    for (Region& region : query->regions()) {
      region.center_m = {0.0f, 0.0f, height_m};
      region.half_extent_m = glm::vec3(0.5f);
      region.t = at_s(5.1);
    }
    transaction.add_query(*query, count);
  };
}

class UnderestimatedBatches : public DatabaseTest, public testing::WithParamInterface<Batch> {
 protected:
  void SetUp() override {
    open({.chunk = Nanoseconds(1'000'000)});
    create(row_of(add(GetParam().mesh()), {0.0, 0.0, mesh_m}), at_s(5.1));
    add_batch_ = GetParam().prepare(database());
    batch_ = database().make_transaction({.max_queries = 1});
    // The first run also compiles kernels.
    for (int k = 0; k < 2; ++k) {
      submit(mesh_m);
      batch_time_ = database().wait(*batch_).actual_cost;
    }
  }
  void submit(float height_m) {
    batch_->begin({});
    add_batch_(*batch_, height_m);
    database().submit(*batch_);
  }
  /// Expects a short median time of `wait` during an expensive batch that follows cheap ones. `wait` returns
  /// false if the batch was complete before. It begins at different fractions of the batch.
  template <class Wait>
  void expect_short(Wait wait) {
    std::vector<Nanoseconds> waits;
    for (int k = 0; k < 7; ++k) {
      for (int cheap = 0; cheap < 30; ++cheap) {
        submit(empty_m);
        EXPECT_TRUE(database().wait(*batch_).done());
      }
      submit(mesh_m);
      std::this_thread::sleep_for(batch_time_ * (k + 1) / 12);
      const auto begun = std::chrono::steady_clock::now();
      if (wait()) waits.push_back(std::chrono::steady_clock::now() - begun);
      database().wait(*batch_);
    }
    ASSERT_GE(waits.size(), 3u) << "most batches were complete before";
    std::ranges::sort(waits);
    const Nanoseconds median = waits[waits.size() / 2];
    RecordProperty("batch_ns", std::to_string(batch_time_.count()));
    RecordProperty("median_wait_ns", std::to_string(median.count()));
    EXPECT_GT(batch_time_, std::chrono::milliseconds(20)) << "the batch is too short";
    EXPECT_LT(median, batch_time_ / 3);
  }

  AddBatch add_batch_;
  std::unique_ptr<Transaction> batch_;
  Nanoseconds batch_time_{0};
};

TEST_P(UnderestimatedBatches, ArePreempted) {
  const auto small = database().prepare(RayQueryOptions{.name = "small", .capacity = 64}).value();
  for (Ray& ray : small->rays())
    ray = ray_from({0.0f, 0.0f, 45.0f}, {0, 0, -1}, at_s(5.1));
  const auto higher = database().make_transaction({.max_queries = 1});
  Terms terms;
  terms.importance = 1;
  expect_short([&] {
    const bool preempts = batch_->status() == Status::pending;
    higher->begin(terms);
    higher->add_query(*small, 64);
    EXPECT_TRUE(database().execute(*higher).done());
    return preempts;
  });
}

TEST_P(UnderestimatedBatches, EndSoonWhenCancelled) {
  expect_short([&] {
    database().cancel(*batch_);
    return database().wait(*batch_).status == Status::cancelled;
  });
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, UnderestimatedBatches,
    testing::Values(Batch{"Nearest", [] { return repeated_triangle(10'000); },
                          [](Database& database) { return nearest(database, 400, false); }},
                    Batch{"Signs", [] { return stacked_prisms(6'000); },
                          [](Database& database) { return nearest(database, 400, true); }},
                    Batch{"LowestIds", [] { return repeated_triangle(8'000); },
                          [](Database& database) { return regions(database, 400, 8); }},
                    Batch{"Retries", [] { return repeated_triangle(200'000); },
                          [](Database& database) { return regions(database, 100, 0); }},
                    Batch{"RetriesOfLists", [] { return repeated_triangle(30'000); },
                          [](Database& database) { return regions(database, 100, 8); }}),
    [](const auto& batch) { return std::string(batch.param.name); });

}  // namespace
}  // namespace rtstdb::test
