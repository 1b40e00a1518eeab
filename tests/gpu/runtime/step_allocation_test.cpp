// The modules of configs/crossing/crossing.yaml do not allocate in their steps, in real time and with the
// real database: the executive steps them as in a session, and the heap traffic of their tasks is counted
// after the warm-up.

#include <gtest/gtest.h>

#include <atomic>

#include "runtime/executive/executive.hpp"
#include "runtime/modules/run_events.hpp"
#include "runtime/run/clocks.hpp"
#include "runtime/run/file_streams.hpp"
#include "runtime/run/scenery.hpp"
#include "runtime/run/wiring.hpp"
#include "tests/paths.h"
#include "tests/support/allocation_guard.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::run {
namespace {

/// Counts the heap traffic of a task.
class Guarded final : public executive::Task {
 public:
  Guarded(executive::Task& task, std::uint64_t warmup_runs) : task_(task), warmup_runs_(warmup_runs) {}

  void latch(const executive::TickInfo& tick) noexcept override {
    guarded(tick, [&] { task_.latch(tick); });
  }
  void step(const executive::TickInfo& tick) noexcept override {
    guarded(tick, [&] { task_.step(tick); });
    if (tick.run >= warmup_runs_) guarded_runs_.fetch_add(1);
  }
  void publish(const executive::TickInfo& tick) noexcept override {
    guarded(tick, [&] { task_.publish(tick); });
  }
  std::uint64_t guarded_runs() const noexcept { return guarded_runs_.load(); }

 private:
  template <typename Action>
  void guarded(const executive::TickInfo& tick, Action action) noexcept {
    if (tick.run < warmup_runs_) return action();
    allocation_guard::enter_tick();
    action();
    allocation_guard::leave_tick();
  }

  executive::Task& task_;
  const std::uint64_t warmup_runs_;
  std::atomic<std::uint64_t> guarded_runs_{0};
};

/// The crossing with the scanner's parameters changed, as `--set` changes them.
class HeapTraffic : public ::testing::TestWithParam<std::vector<std::string>> {};

TEST_P(HeapTraffic, IsAbsentInTheStepsOfTheCrossing) {
  config::Diagnostics diagnostics;
  std::vector<std::string> overrides{"realtime.scheduler=other"};
  for (const std::string& parameter : GetParam())
    overrides.push_back("tasks.scanner.parameters." + parameter);
  auto scenario = config::load_scenario(std::string(HIL_SOURCE_DIR) + "/configs/crossing/crossing.yaml",
                                        overrides, scenario_types(), diagnostics);
  ASSERT_TRUE(scenario) << diagnostics.to_text();
  auto wiring = wire(*scenario, diagnostics);
  ASSERT_TRUE(wiring) << diagnostics.to_text();

  executive::MonotonicClock clock;
  const DatabaseClock database_clock(clock);
  DeviceClock run_clock(clock);
  rtstdb::DatabaseOptions options;
  options.clock = &database_clock;
  options.max_entities = scenario->world.max_entities;
  options.max_geometries = scenario->world.max_geometries;
  options.retained_changes = scenario->world.retained_changes;
  options.queue_capacity = scenario->world.queue_capacity;
  auto opened = rtstdb::Database::open(options);
  ASSERT_TRUE(opened) << opened.error().message;
  const auto database = std::move(opened).value();
  modules::NamedWorld world(database.get(), wiring->layers.names());
  const tests::TemporaryFolder folder;
  RunFileStreams files(folder.path(), false);
  RunLog log(folder.path() / "run.log", false);
  WorldFields fields(log);
  create_scenery(*scenario, wiring->scenery, world, fields);
  modules::RunEvents events;

  struct Origin final : executive::TickHooks {
    explicit Origin(DeviceClock& run_clock) : clock(run_clock) {}
    void before_first_tick(std::int64_t start_ns) noexcept override { clock.set_origin(start_ns); }
    DeviceClock& clock;
  } origin(run_clock);
  executive::ExecutiveOptions run_options;
  run_options.base_period_ns = scenario->base_period_ns;
  run_options.duration_ticks = 2'500;  // two and a half sweeps
  run_options.clock = &clock;
  run_options.hooks = &origin;
  run_options.realtime.scheduler = executive::Scheduler::other;
  run_options.realtime.lock_memory = false;
  executive::Executive executive(run_options);
  std::vector<std::unique_ptr<ModuleTask>> tasks;
  std::vector<std::unique_ptr<Guarded>> guarded;
  for (WiredModule& wired : wiring->modules) {
    const config::TaskSection& section = *wired.section;
    const modules::TaskParameters facts = task_parameters(*scenario, section);
    const modules::Setup setup{.task = facts, .events = events, .files = files};
    if (modules::WorldModule* const module = wired.module->world_module()) module->configure(world, setup);
    if (modules::Module* const module = wired.module->plain_module()) module->configure(setup);
    tasks.push_back(std::make_unique<ModuleTask>("module " + section.module.text, *wired.module, wired.links,
                                                 facts.deadline_ns, wiring->signals, database.get(),
                                                 run_clock, events));
    guarded.push_back(std::make_unique<Guarded>(*tasks.back(), 5));
    executive.add_task({.name = section.module.text,
                        .every_ticks = section.every_ticks,
                        .deadline_ns = section.deadline_ns,
                        .warmup_runs = 5,
                        .thread = section.thread},
                       *guarded.back());
  }

  allocation_guard::reset();
  const std::atomic<bool> never{false};
  executive.run(never);
  EXPECT_EQ(allocation_guard::seen().allocations, 0U);
  EXPECT_EQ(allocation_guard::seen().frees, 0U);
  // Each module ran, and the world was written and queried.
  ASSERT_EQ(guarded.size(), 5U);
  for (const auto& task : guarded)
    EXPECT_GT(task->guarded_runs(), 20U);
  const rtstdb::TransactionCounts counts = database->counts();
  EXPECT_GT(counts.committed + counts.late, 200U);
  const auto hits = wiring->signals.find("scanner.hits");
  ASSERT_TRUE(hits);
  EXPECT_GT(wiring->signals.value(*hits), 0.0) << "the scanner saw nothing";
  // Their queries must not outlive the database.
  for (WiredModule& wired : wiring->modules)
    wired.module.reset();
}

INSTANTIATE_TEST_SUITE_P(Scanners, HeapTraffic,
                         ::testing::Values(std::vector<std::string>{"columns=240", "rows=60"},
                                           std::vector<std::string>{
                                               "columns=48", "rows=12", "compare=[]", "divergence=2 deg",
                                               "returns=3", "threshold=1e-9", "range_noise=1 cm", "targets=4",
                                               "point_cloud={rate: 1 Hz}"}));

}  // namespace
}  // namespace hil::run
