// The peer of the transactions benchmark, and its program in tiny mode.

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>
#include <vector>

#include "bench/transactions/sqlite_world.hpp"
#include "tests/support/bench_program.hpp"

namespace hil::bench {
namespace {

TEST(SqliteWorld, FindsMovedBoxes) {
  const auto file = std::filesystem::path(testing::TempDir()) / "hil-sqlite-world-test";
  const rtstdb::Bounds unit{glm::vec3(0.0f), glm::vec3(1.0f)};
  const rtstdb::Bounds elsewhere{glm::vec3(5.0f), glm::vec3(6.0f)};
  {
    SqliteWorld world(file, std::vector{unit, unit, elsewhere});
    std::vector<std::uint32_t> found;
    world.touching({glm::vec3(0.5f), glm::vec3(2.0f)}, found);
    EXPECT_EQ(found, (std::vector<std::uint32_t>{0, 1}));
    world.move(std::vector<NumberedBox>{{1, elsewhere}});
    world.touching({glm::vec3(0.5f), glm::vec3(2.0f)}, found);
    EXPECT_EQ(found, (std::vector<std::uint32_t>{0}));
    world.touching({glm::vec3(6.0f), glm::vec3(7.0f)}, found);
    EXPECT_EQ(found, (std::vector<std::uint32_t>{1, 2})) << "touching counts";
  }
  EXPECT_THROW(SqliteWorld("/no/such/folder/world", {}), std::runtime_error);
  for (const char* ending : {"", "-wal", "-shm"})
    std::filesystem::remove(file.string() + ending);
}

constexpr Expected expected_figures[] = {
    {"commits_one_row", "commit/s", ""},
    {"commits_one_row_without_spin", "commit/s", ""},
    {"commits_one_row_queued_64", "commit/s", ""},
    {"commits_1000_rows", "commit/s", ""},
    {"update_and_64_rays_p50", "us", ""},
    {"update_and_64_rays_p99", "us", ""},
    {"update_and_64_rays_p999", "us", ""},
    {"preemption_wait_rays_p50", "us", ""},
    {"preemption_wait_rays_p99", "us", ""},
    {"preemption_wait_regions_p50", "us", ""},
    {"preemption_wait_regions_p99", "us", ""},
    {"preemption_wait_nearest_p50", "us", ""},
    {"preemption_wait_nearest_p99", "us", ""},
    {"preemption_wait_cones_p50", "us", ""},
    {"preemption_wait_cones_p99", "us", ""},
    {"preemption_wait_overlaps_p50", "us", ""},
    {"preemption_wait_overlaps_p99", "us", ""},
    {"preemption_wait_contacts_p50", "us", ""},
    {"preemption_wait_contacts_p99", "us", ""},
    {"preemption_wait_impacts_p50", "us", ""},
    {"preemption_wait_impacts_p99", "us", ""},
    {"preemption_wait_images_p50", "us", ""},
    {"preemption_wait_images_p99", "us", ""},
    {"durability_async_vs_volatile", "commit/s", "ours, volatile"},
    {"durability_async_vs_volatile_turning", "commit/s", "ours, volatile"},
    {"durability_async_vs_volatile_1000_rows", "commit/s", "ours, volatile"},
    {"log_bandwidth", "MB/s", "pwrite + fdatasync"},
    {"log_bandwidth_64_kB", "MB/s", "pwrite + fdatasync"},
    {"log_bandwidth_4_MB", "MB/s", "pwrite + fdatasync"},
    {"commit_latency_group_p50", "us", "pwrite + fdatasync"},
    {"commit_latency_group_p99", "us", "pwrite + fdatasync"},
    {"commit_latency_sync_p50", "us", "pwrite + fdatasync"},
    {"commit_latency_sync_p99", "us", "pwrite + fdatasync"},
    {"recovery", "ms", ""},
    {"recovery_of_the_log_alone", "ms", ""},
    {"sqlite_update_region", "round/s", "SQLite 3"},
    {"sqlite_update_region_few", "round/s", "SQLite 3"},
};

TEST(BenchTransactions, PrintsOneJsonLinePerFigureInTinyMode) {
  expect_figures(run_program(HIL_BENCH_TRANSACTIONS " --tiny --json"), expected_figures);
}

TEST(BenchTransactions, RefusesAnUnknownArgumentWithTheKnownOnes) {
  const Output output = run_program(HIL_BENCH_TRANSACTIONS " --fast");
  EXPECT_EQ(output.exit_code, 2);
  EXPECT_NE(output.text.find("unknown argument '--fast'; known: --json, --tiny, --awake, commits"),
            std::string::npos)
      << output.text;
}

}  // namespace
}  // namespace hil::bench
