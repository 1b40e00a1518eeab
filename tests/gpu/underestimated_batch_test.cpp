// Batches that are thought to take less than a chunk, since so many of their kind were cheap, and take long:
// whoever waits for them does not wait for their end. Of each kind whose time goes into another dispatch.

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

/// From places at this height: dear where the mesh is.
using Ask = std::function<void(Transaction&, float height_m)>;

struct ShortBatch {
  const char* name;
  TriangleMesh (*mesh)();
  Ask (*prepare)(Database&);
};

std::ostream& operator<<(std::ostream& out, const ShortBatch& batch) {
  return out << batch.name;
}

constexpr float mesh_m = 50.0f, nothing_m = -500.0f;

Ask nearest(Database& database, std::uint32_t count, bool is_signed) {
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

Ask regions(Database& database, std::uint32_t count, std::uint32_t ids) {
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

class ThoughtShort : public DatabaseTest, public testing::WithParamInterface<ShortBatch> {
 protected:
  void SetUp() override {
    open({.chunk = Nanoseconds(1'000'000)});
    create(row_of(add(GetParam().mesh()), {0.0, 0.0, mesh_m}), at_s(5.1));
    ask_ = GetParam().prepare(database());
    batch_ = database().make_transaction({.max_queries = 1});
    // The first also compiles.
    for (int k = 0; k < 2; ++k) {
      submit(mesh_m);
      whole_ = database().wait(*batch_).actual_cost;
    }
  }
  void submit(float height_m) {
    batch_->begin({});
    ask_(*batch_, height_m);
    database().submit(*batch_);
  }
  /// What `wait` takes, the median, while a dear batch is at it that came behind cheap ones; where that was
  /// at its end already, `wait` says no.
  template <class Wait>
  void expect_short(Wait wait) {
    std::vector<Nanoseconds> waits;
    for (int k = 0; k < 7; ++k) {
      for (int cheap = 0; cheap < 30; ++cheap) {
        submit(nothing_m);
        EXPECT_TRUE(database().wait(*batch_).done());
      }
      submit(mesh_m);
      std::this_thread::sleep_for(whole_ * (k + 1) / 12);
      const auto begun = std::chrono::steady_clock::now();
      if (wait()) waits.push_back(std::chrono::steady_clock::now() - begun);
      database().wait(*batch_);
    }
    ASSERT_GE(waits.size(), 3u) << "too few were under way still";
    std::ranges::sort(waits);
    const Nanoseconds median = waits[waits.size() / 2];
    RecordProperty("whole_ns", std::to_string(whole_.count()));
    RecordProperty("median_wait_ns", std::to_string(median.count()));
    EXPECT_GT(whole_, std::chrono::milliseconds(20)) << "a batch is no crowd";
    EXPECT_LT(median, whole_ / 3);
  }

  Ask ask_;
  std::unique_ptr<Transaction> batch_;
  Nanoseconds whole_{0};
};

TEST_P(ThoughtShort, ItIsPassedByUrgentQueries) {
  const auto small = database().prepare(RayQueryOptions{.name = "urgent", .capacity = 64}).value();
  for (Ray& ray : small->rays())
    ray = ray_from({0.0f, 0.0f, 45.0f}, {0, 0, -1}, at_s(5.1));
  const auto urgent = database().make_transaction({.max_queries = 1});
  Terms terms;
  terms.importance = 1;
  expect_short([&] {
    const bool passes = batch_->status() == Status::pending;
    urgent->begin(terms);
    urgent->add_query(*small, 64);
    EXPECT_TRUE(database().execute(*urgent).done());
    return passes;
  });
}

TEST_P(ThoughtShort, ItEndsSoonWhenItIsCancelled) {
  expect_short([&] {
    database().cancel(*batch_);
    return database().wait(*batch_).status == Status::cancelled;
  });
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, ThoughtShort,
    testing::Values(ShortBatch{"Nearest", [] { return repeated_triangle(10'000); },
                               [](Database& database) { return nearest(database, 400, false); }},
                    ShortBatch{"Signs", [] { return stacked_prisms(6'000); },
                               [](Database& database) { return nearest(database, 400, true); }},
                    ShortBatch{"LowestOfLists", [] { return repeated_triangle(8'000); },
                               [](Database& database) { return regions(database, 400, 8); }},
                    ShortBatch{"AskedAgain", [] { return repeated_triangle(200'000); },
                               [](Database& database) { return regions(database, 100, 0); }},
                    ShortBatch{"ListsAskedAgain", [] { return repeated_triangle(30'000); },
                               [](Database& database) { return regions(database, 100, 8); }}),
    [](const auto& batch) { return std::string(batch.param.name); });

}  // namespace
}  // namespace rtstdb::test
