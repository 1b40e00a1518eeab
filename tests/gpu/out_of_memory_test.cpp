// Allocations fail while a database opens, adds geometry and prepares queries: the n-th one, or all from the
// n-th on. The long form tests each n (each 13th where kernels are compiled), the short form a sample. Each
// call returns an error, the database goes on, and nothing leaks (the address sanitizer checks that).

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <iostream>

#include <rtstdb/database.hpp>

#include "tests/gpu/failing_allocation.hpp"
#include "tests/gpu/kind_cases.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::test {
namespace {

using Then = FailingAllocation::Then;

/// The distance between tested allocations.
struct Every {
  std::uint64_t short_form, long_form = 1;
};

std::uint64_t stride(const Every& every) {
  if (hil::tests::is_long()) return every.long_form;
#if defined(__SANITIZE_ADDRESS__)
  return 3 * every.short_form;
#else
  return every.short_form;
#endif
}

DatabaseOptions small() {
  DatabaseOptions options;
  if (const char* select = std::getenv("HIL_TEST_GPU")) options.gpu = select;
  options.max_entities = 16;
  options.max_geometries = 4096;
  options.retained_changes = 64;
  options.queue_capacity = 4;
  options.validation = Validation::off;
  return options;
}

/// Calls `step`, each time with another failing allocation, until it has fewer allocations; alternately with
/// one failing allocation and with all from it on. Returns the approximate number of allocations.
std::uint64_t fail_in(const Every& every, const std::function<Result<void>()>& step) {
  std::uint64_t number = 1;
  Then then = Then::goes_on;
  for (bool reached = true; reached && !testing::Test::HasFatalFailure(); number += stride(every)) {
    SCOPED_TRACE(testing::Message() << "allocation " << number
                                    << (then == Then::runs_out ? " and all after it" : ""));
    Result<void> done;
    {
      const FailingAllocation failing(number, then);
      done = step();
      reached = failing.happened();
    }
    then = then == Then::goes_on ? Then::runs_out : Then::goes_on;
    if (done) continue;
    EXPECT_TRUE(reached) << done.error().message;
    EXPECT_EQ(done.error().code, ErrorCode::out_of_memory) << done.error().message;
    EXPECT_FALSE(done.error().message.empty());
  }
  std::cout << "about " << number << " allocations\n";
  return number;
}

template <class T>
Result<void> error_of(const Result<T>& result) {
  if (result) return {};
  return result.error();
}

TEST(OutOfMemory, IsAnErrorOfOpen) {
  bool opened_in_the_end = false;
  const std::uint64_t allocations = fail_in({401}, [&] {
    auto opened = Database::open(small());
    opened_in_the_end = opened.ok();
    return error_of(opened);
  });
  EXPECT_TRUE(opened_in_the_end);
  EXPECT_GT(allocations, 100u) << "most allocations are not counted";
}

class OutOfMemoryInSetup : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = Database::open(small());
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    database_ = std::move(opened).value();
  }
  /// Adds a geometry and expects a ray to hit it.
  void expect_usable() {
    const auto box = database_->add_geometry(make_box({2.0, 2.0, 2.0}), "box");
    ASSERT_TRUE(box.ok()) << box.error().message;
    const auto made = database_->prepare(RayQueryOptions{.name = "beam", .capacity = 1});
    ASSERT_TRUE(made.ok()) << made.error().message;
    const auto transaction = database_->make_transaction({.max_writes = 2, .max_queries = 1});
    EntityRow row;
    row.geometry = box.value();
    made.value()->rays()[0].origin_m = {-6.0f, 0.0f, 0.0f};
    transaction->begin({});
    if (entity_.valid()) transaction->remove(entity_);
    const auto ordinal = transaction->create(row);
    transaction->add_query(*made.value(), 1);
    const Outcome& outcome = database_->execute(*transaction);
    ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
    entity_ = transaction->created(ordinal);
    EXPECT_EQ(made.value()->hits()[0].entity, entity_);
    const auto mesh = database_->geometry(box.value());
    ASSERT_TRUE(mesh.has_value());
    EXPECT_EQ(mesh->triangles.size(), 12u) << "the mesh of another geometry";
  }

  std::unique_ptr<Database> database_;
  EntityId entity_;
};

TEST_F(OutOfMemoryInSetup, IsAnErrorOfAddGeometry) {
  for (const bool deforms : {false, true}) {
    TriangleMesh mesh = make_sphere(1.0, 2);
    mesh.corner_normals.resize(mesh.triangles.size(), {glm::vec3(1), glm::vec3(1), glm::vec3(1)});
    mesh.corner_colors = mesh.corner_normals;
    fail_in({19}, [&] {
      return error_of(database_->add_geometry(mesh, "a name that is too long for the buffer of a string",
                                              {.deforms = deforms}));
    });
    expect_usable();
  }
}

TEST_F(OutOfMemoryInSetup, IsAnErrorOfSnapshots) {
  const auto deforming = database_->add_geometry(make_sphere(1.0, 2), "deforming", {.deforms = true});
  ASSERT_TRUE(deforming.ok()) << deforming.error().message;
  fail_in({1}, [&] { return error_of(database_->snapshot(ReadAt::latest())); });
  fail_in({1}, [&] { return error_of(database_->geometry(deforming.value(), ReadAt::latest())); });
  expect_usable();
}

TEST_F(OutOfMemoryInSetup, IsAnErrorOfPrepare) {
  const std::string name = "a name that is too long for the buffer of a string";
  const auto fail_to_prepare = [&](const auto& options) {
    fail_in({.short_form = 701, .long_form = 13}, [&] { return error_of(database_->prepare(options)); });
  };
  for (const AnyQueryOptions& options : all_tested_options()) {
    SCOPED_TRACE(kind_name(options));
    std::visit(
        [&](auto of_kind) {
          of_kind.name = name;
          fail_to_prepare(of_kind);
        },
        with(options, 100));
  }
  expect_usable();
}

}  // namespace
}  // namespace rtstdb::test
