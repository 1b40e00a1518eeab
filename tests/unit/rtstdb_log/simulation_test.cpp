// Random simulations of a log: commits, checkpoints, rotations, disks that fail or are full, power losses and
// killed processes. Recovery must return a state that existed and is not older than the durable version.

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "live_world.hpp"
#include "rtstdb/log/version_range.hpp"
#include "rtstdb/log/writer.hpp"
#include "tests/support/rounds.hpp"
#include "tests/support/simulation/clock.hpp"
#include "tests/support/simulation/disk.hpp"

namespace rtstdb::log::test {

namespace {

class Simulation {
  using SimulatedDisk = hil::tests::SimulatedDisk;
  static constexpr std::uint64_t database_id = 0x1234'5678'9abc'def0;

 public:
  explicit Simulation(std::uint64_t seed) : seed_(seed), random_(seed), disk_(seed + 1) {}

  void run(int processes) {
    for (int process = 0; process < processes && !testing::Test::HasFatalFailure(); ++process) {
      SCOPED_TRACE("HIL_LOG_SEED=" + std::to_string(seed_) + ", process " + std::to_string(process) +
                   ", after step " + std::to_string(steps_));
      run_process();
    }
  }

  std::uint64_t steps() const { return steps_; }

 private:
  std::uint32_t below(std::uint32_t limit) { return static_cast<std::uint32_t>(random_() % limit); }

  void run_process() {
    auto recovered = recover(disk_);
    ASSERT_TRUE(recovered.ok()) << recovered.error().message;
    check(recovered.value());
    if (testing::Test::HasFatalFailure()) return;
    LiveWorld world(random_(), history_, std::size_t{1} << (10 + below(4)), recovered.value());
    world.collect_some_commits();
    world.lose_slices_per_mille(below(2) == 0 ? 0 : 50);
    WriterOptions options;
    options.segment_bytes = 512u << below(5);
    options.checkpoint_every_bytes = 2048u << below(5);
    options.rows_per_slice = 1 + below(16);
    if (below(2) == 0) options.flush_interval = Nanoseconds(3'000'000);
    options.prune = seed_ % 3 == 0 && below(3) != 0;
    pruned_ = pruned_ || options.prune;
    set_faults();
    const std::uint64_t next_file =
        recovered.value().listing.geometries.empty() ? 1 : recovered.value().listing.geometries.back() + 1;
    auto started = Writer::start(disk_, clock_, world.ring(), world, options,
                                 start_after(recovered.value(), database_id));
    if (started) {
      continue_from(recovered.value().world.latest.version);
      durable_ = std::max(durable_, started.value()->durable());
      drive(world, *started.value(), next_file);
      if (testing::Test::HasFatalFailure()) return;
      end(world, *started.value());
    } else {
      crash_or_kill();
    }
    // Files that the killed process would have removed stay.
    disk_.fail_kind(DiskCall::remove, EIO);
    started = Error{};
    disk_.fail_kind(DiskCall::remove, 0);
    set_no_faults();
  }

  void set_faults() {
    disk_.fail_per_mille(below(3) == 0 ? 1 + below(200) : 0);
    if (below(6) == 0) disk_.set_capacity(below(60'000));
  }
  void set_no_faults() {
    disk_.fail_per_mille(0);
    disk_.set_capacity(~std::uint64_t{0});
  }

  void drive(LiveWorld& world, Writer& writer, std::uint64_t next_file) {
    for (std::uint32_t step = 5 + below(150); step > 0; --step, ++steps_) {
      const std::uint32_t what = below(100);
      if (what < 45) world.commit();
      if (what >= 45 && what < 50) world.commit_and_discard();
      if (what >= 50 && what < 53) world.add_geometry(disk_, database_id, next_file++);
      if (what >= 50 && what < 52) world.add_material();
      if (what >= 51 && what < 53) world.add_light();
      if (what == 53) writer.checkpoint_soon();
      if (what == 54) writer.flush_soon();
      if (what == 55) set_faults();
      if (what == 56) set_no_faults();
      if (what >= 57 && what < 62) world.recorder().maintain();
      if (what >= 62 && what < 70) clock_.advance(Nanoseconds(1'000'000 << below(12)));
      if (what >= 70 && below(4) != 0) world.recorder().flush();
      // The real time is only informative: it may decrease.
      if (what >= 70) writer.step(real_time_ns_ -= 1'000'000'000);
      ASSERT_GE(writer.durable(), durable_in_process_);
      durable_in_process_ = writer.durable();
      durable_ = std::max(durable_, writer.durable());
      ASSERT_LE(durable_, world.latest() + 1000);
    }
    durable_in_process_ = 0;
  }

  void end(LiveWorld& world, Writer& writer) {
    if (below(4) == 0) {
      if (below(2) == 0) set_no_faults();
      world.recorder().maintain();
      const bool closed = writer.close(0).ok();
      if (closed && !world.recorder().in_gap()) exact_version_ = world.latest();
    }
    crash_or_kill();
  }

  void crash_or_kill() {
    if (below(3) == 0) {
      disk_.kill();
    } else {
      disk_.crash();
    }
  }

  void check(const Recovered& recovered) {
    const Version version = recovered.world.latest.version;
    const auto image = history_.images.find(version);
    ASSERT_NE(image, history_.images.end())
        << "version " << version << " never existed; " << recovered.report.describe();
    ASSERT_TRUE(image_of(recovered.world) == image->second)
        << "version " << version << " differs; " << recovered.report.describe();
    ASSERT_GE(version, history_.newest_valid(durable_))
        << "durable were versions up to " << durable_ << "; " << recovered.report.describe();
    ASSERT_EQ(version, exact_version_.value_or(version)) << recovered.report.describe();
    exact_version_.reset();
    ASSERT_TRUE(recovered.report.damaged_checkpoints.empty()) << recovered.report.damaged_checkpoints.front();
    check_without_checkpoints(recovered);
    check_history(recovered);
  }

  /// A start makes the recovered version durable. Until then, the next recovery may find a later one: a crash
  /// can undo the creation of a segment that replaced groups of an earlier segment.
  void continue_from(Version version) {
    history_.forget_after(version);
    history_.valid.insert(version);
    durable_ = std::min(durable_, version);
  }

  /// The log without checkpoints leads to the same world, up to a gap: no checkpoint is ahead of it.
  void check_without_checkpoints(const Recovered& recovered) {
    if (pruned_) return;
    auto contents = disk_.contents();
    std::erase_if(contents, [](const auto& file) { return file.first.starts_with("checkpoint."); });
    SimulatedDisk disk(1, contents);
    const auto replayed = recover(disk);
    ASSERT_TRUE(replayed.ok()) << replayed.error().message;
    const Version version = replayed.value().world.latest.version;
    const auto image = history_.images.find(version);
    ASSERT_NE(image, history_.images.end()) << "version " << version << " never existed";
    ASSERT_TRUE(image_of(replayed.value().world) == image->second)
        << "without checkpoints version " << version;
    ASSERT_TRUE(version == recovered.world.latest.version || replayed.value().report.gap_from != 0)
        << replayed.value().report.describe();
  }

  /// After pruning, and after crashes during pruning, the remaining log can be read from its begin to its
  /// end.
  void check_history(const Recovered& recovered) {
    if (recovered.report.database_id == 0) return;
    const auto extent = read_extent(disk_, false);
    ASSERT_TRUE(extent.ok()) << extent.error().message;
    if (extent.value().gaps.empty()) {
      ASSERT_EQ(extent.value().last.version, recovered.world.latest.version) << recovered.report.describe();
    }
    ASSERT_TRUE(pruned_ || extent.value().first.version == 0);
  }

  std::uint64_t seed_;
  bool pruned_ = false;  // by any process
  std::mt19937_64 random_;
  SimulatedDisk disk_;
  hil::tests::SimulatedClock clock_;
  History history_{{{0, image_of(World{})}}, {0}};
  Version durable_ = 0, durable_in_process_ = 0;
  std::optional<Version> exact_version_;
  std::int64_t real_time_ns_ = 0;
  std::uint64_t steps_ = 0;
};

// HIL_LOG_SEED runs one seed, which a failure prints; HIL_LOG_SEEDS sets the number of seeds.
std::uint64_t from_environment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// Twelve simulated processes for each seed.
TEST(LogSimulation, RecoversAStateThatExistedAndNoOlderThanTheDurableOne) {
  const std::uint64_t only = from_environment("HIL_LOG_SEED", 0);
  const std::uint64_t first = std::max<std::uint64_t>(only, 1);
  const std::uint64_t seeds =
      only != 0 ? 1 : from_environment("HIL_LOG_SEEDS", hil::tests::rounds(150, 20'000));
  std::uint64_t steps = 0;
  for (std::uint64_t seed = first; seed < first + seeds && !HasFatalFailure(); ++seed) {
    Simulation simulation(seed);
    simulation.run(12);
    steps += simulation.steps();
  }
  EXPECT_TRUE(steps > 50 * seeds || only != 0);
}

}  // namespace
}  // namespace rtstdb::log::test
