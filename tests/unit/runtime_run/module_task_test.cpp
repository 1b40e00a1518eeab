// Modules as tasks of the executive, with a fake module and database.

#include "runtime/run/module_task.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "runtime/modules/run_events.hpp"
#include "tests/unit/runtime_run/counted_reads.hpp"

namespace hil::run {
namespace {

constexpr std::int64_t ms = 1'000'000;

/// A database with a latest version and one outcome; it accepts nothing else.
class FakeDatabase final : public rtstdb::Database {
 public:
  rtstdb::Version version = 0;
  rtstdb::Outcome outcome;  ///< of every transaction

  const rtstdb::DeviceInfo& device() const noexcept override { return device_; }
  rtstdb::Result<rtstdb::GeometryId> add_geometry(const rtstdb::TriangleMesh& /*mesh*/,
                                                  std::string_view /*name*/,
                                                  const rtstdb::GeometryOptions& /*options*/) override {
    return refused();
  }
  rtstdb::Result<std::unique_ptr<rtstdb::Query>> prepare_query(rtstdb::QueryOptionsRef /*options*/) override {
    return refused();
  }
  std::unique_ptr<rtstdb::Transaction> make_transaction(
      const rtstdb::TransactionOptions& /*options*/) override {
    return nullptr;
  }
  rtstdb::Result<void> calibrate(rtstdb::Transaction& /*transaction*/) override { return refused(); }
  rtstdb::Result<std::unique_ptr<rtstdb::Reservation>> reserve(
      const rtstdb::ReservationOptions& /*options*/) override {
    return refused();
  }
  rtstdb::Result<std::unique_ptr<rtstdb::StandingQuery>> watch(
      const rtstdb::StandingRegion& /*region*/, const rtstdb::StandingOptions& /*options*/) override {
    return refused();
  }
  rtstdb::Result<std::unique_ptr<rtstdb::StandingQuery>> watch(
      const rtstdb::StandingRay& /*ray*/, const rtstdb::StandingOptions& /*options*/) override {
    return refused();
  }
  rtstdb::Result<std::unique_ptr<rtstdb::StandingQuery>> watch(
      const rtstdb::StandingNearest& /*nearest*/, const rtstdb::StandingOptions& /*options*/) override {
    return refused();
  }
  void submit(rtstdb::Transaction& /*transaction*/) noexcept override {}
  const rtstdb::Outcome& wait(rtstdb::Transaction& /*transaction*/) noexcept override { return outcome; }
  void cancel(rtstdb::Transaction& /*transaction*/) noexcept override {}
  rtstdb::VersionInfo latest() const noexcept override { return {.version = version}; }
  rtstdb::Version durable() const noexcept override { return 0; }
  bool wait_until_durable(rtstdb::Version /*version*/, rtstdb::Nanoseconds /*at_most*/) noexcept override {
    return false;
  }
  rtstdb::Durability durability() const override { return {}; }
  const rtstdb::Recovery& recovery() const noexcept override { return recovery_; }
  rtstdb::Result<void> close() override { return {}; }
  rtstdb::Result<std::vector<rtstdb::EntityState>> snapshot(
      const rtstdb::ReadAt& /*read_at*/) const override {
    return refused();
  }
  std::optional<rtstdb::GeometryId> find_geometry(std::string_view /*name*/) const override {
    return std::nullopt;
  }
  std::optional<rtstdb::TriangleMesh> geometry(rtstdb::GeometryId /*id*/) const override {
    return std::nullopt;
  }
  rtstdb::Result<rtstdb::MaterialId> add_material(const rtstdb::Material& /*material*/,
                                                  std::string_view /*name*/) override {
    return refused();
  }
  rtstdb::Result<rtstdb::LightId> add_light(const rtstdb::Light& /*light*/,
                                            std::string_view /*name*/) override {
    return refused();
  }
  std::optional<rtstdb::LightId> find_light(std::string_view /*name*/) const override { return std::nullopt; }
  std::optional<rtstdb::Light> light(rtstdb::LightId /*id*/) const noexcept override { return std::nullopt; }
  rtstdb::Result<rtstdb::FieldReport> build_field(rtstdb::GeometryId /*id*/,
                                                  const rtstdb::FieldOptions& /*options*/) override {
    return refused();
  }
  std::optional<rtstdb::FieldReport> field(rtstdb::GeometryId /*id*/) const override { return std::nullopt; }
  std::optional<rtstdb::GeometryInfo> geometry_info(rtstdb::GeometryId /*id*/) const override {
    return std::nullopt;
  }
  std::optional<rtstdb::MaterialId> find_material(std::string_view /*name*/) const override {
    return std::nullopt;
  }
  std::optional<rtstdb::Material> material(rtstdb::MaterialId /*id*/) const noexcept override {
    return std::nullopt;
  }
  rtstdb::Result<rtstdb::TriangleMesh> geometry(rtstdb::GeometryId /*id*/,
                                                const rtstdb::ReadAt& /*read_at*/) const override {
    return refused();
  }
  rtstdb::TransactionCounts counts() const noexcept override { return {}; }
  rtstdb::SchedulerCounts scheduler_counts() const override { return {}; }
  rtstdb::ShapeCounts shape_counts() const noexcept override { return {}; }
  rtstdb::StandingCounts standing_counts() const noexcept override { return {}; }
  rtstdb::Health health() const override { return {}; }

 private:
  static rtstdb::Error refused() { return {.code = rtstdb::ErrorCode::no_device, .message = "a fake"}; }
  rtstdb::DeviceInfo device_;
  rtstdb::Recovery recovery_;
};

/// A transaction that is only executed.
class AnyTransaction final : public rtstdb::Transaction {
 public:
  void begin(const rtstdb::Terms& /*terms*/) noexcept override {}
  void expect_exists(rtstdb::EntityId /*entity*/) noexcept override {}
  void expect_written_by(rtstdb::EntityId /*entity*/, rtstdb::Version /*version*/) noexcept override {}
  std::uint32_t create(const rtstdb::EntityRow& /*row*/) noexcept override { return 0; }
  void update(rtstdb::EntityId /*entity*/, const rtstdb::EntityRow& /*row*/) noexcept override {}
  void update_motion(rtstdb::EntityId /*entity*/, const rtstdb::Motion& /*motion*/) noexcept override {}
  void remove(rtstdb::EntityId /*entity*/) noexcept override {}
  void update_geometry(rtstdb::GeometryId /*geometry*/,
                       std::span<const glm::vec3> /*positions_m*/) noexcept override {}
  std::uint32_t read(rtstdb::EntityId /*entity*/) noexcept override { return 0; }
  void add_query(rtstdb::Query& /*query*/, std::uint32_t /*count*/) noexcept override {}
  rtstdb::EntityId created(std::uint32_t /*ordinal*/) const noexcept override { return {}; }
  const rtstdb::EntityState* state(std::uint32_t /*ordinal*/) const noexcept override { return nullptr; }
  rtstdb::Status status() const noexcept override { return {}; }
  const rtstdb::Outcome& outcome() const noexcept override { return outcome_; }

 private:
  rtstdb::Outcome outcome_;
};

/// Records its inputs; its output is its first input plus one.
class Recorder final : public modules::WorldModule {
 public:
  Recorder() {
    ports_.inputs = {{.name = "in", .unit = "", .about = "x"},
                     {.name = "open", .unit = "", .about = "x", .initial = 7.5}};
    ports_.outputs = {{.name = "out", .unit = "", .about = "x", .initial = 3.0},
                      {.name = "untouched", .unit = "", .about = "x", .initial = 4.0}};
  }
  const modules::WorldPorts& ports() const noexcept override { return ports_; }
  void configure(modules::World& /*world*/, const modules::Setup& /*setup*/) override {}
  void step(modules::WorldStep& context) override {
    ++steps;
    if (throws) throw std::runtime_error("the pump is dry");
    seen = context;
    in = context.inputs[0];
    open = context.inputs[1];
    out_before = context.outputs[0];
    context.outputs[0] = in.value + 1.0;
    context.blocked_ns += 11;
    context.gpu_ns += 5;
    if (queried != nullptr) context.execute(*queried, transaction_);
  }

  modules::WorldStep seen;
  int steps = 0;
  signals::SignalValue in, open;
  double out_before = 0.0;
  rtstdb::Database* queried = nullptr;  ///< every step executes a transaction there
  bool throws = false;                  ///< the next step

 private:
  AnyTransaction transaction_;
  modules::WorldPorts ports_;
};

class ModuleTasks : public ::testing::Test {
 protected:
  signals::SignalTable table_;
  const signals::SignalId source_ = table_.add({.name = "source", .unit = "", .writer = "test"});
  const signals::SignalId out_ = table_.add({.name = "m.out", .unit = "", .writer = "m", .initial = 3.0});
  const signals::SignalId untouched_ =
      table_.add({.name = "m.untouched", .unit = "", .writer = "m", .initial = 4.0});
  FakeDatabase database_;
  executive::VirtualClock executive_clock_;
  DeviceClock clock_{executive_clock_};
  modules::RunEvents events_;
  Recorder module_;
  ModuleTask task_{"module m", module_, {.inputs = {{.signal = source_}, {}}, .outputs = {out_, untouched_}},
                   5 * ms,     table_,  &database_,
                   clock_,     events_};
};

TEST_F(ModuleTasks, PassTimesAndVersionToTheStep) {
  clock_.set_origin(1'000 * ms);
  database_.version = 42;
  const executive::TickInfo tick{.tick = 20, .time_ns = 20 * ms, .period_ns = 10 * ms, .run = 2};
  task_.latch(tick);
  database_.version = 43;  // written while the task waits for its thread
  task_.step(tick);
  EXPECT_EQ(module_.seen.run, 2U);
  EXPECT_EQ(module_.seen.time_ns, 20 * ms);
  EXPECT_EQ(module_.seen.period_ns, 10 * ms);
  EXPECT_EQ(module_.seen.deadline, rtstdb::clock_time_ns(1'025 * ms));
  EXPECT_EQ(module_.seen.version, 42U);
  EXPECT_EQ(module_.seen.events, &events_);
  EXPECT_EQ(module_.seen.world_time(), rtstdb::world_time_ns(20 * ms));
}

TEST_F(ModuleTasks, InputsAreConvertedToTheUnitsOfTheirPorts) {
  ModuleTask task("module m", module_,
                  {.inputs = {{.signal = source_, .conversion = {.numerator = 5.0, .denominator = 18.0}}, {}},
                   .outputs = {out_, untouched_}},
                  5 * ms, table_, &database_, clock_, events_);
  table_.write(source_, 36.0, 0);
  const executive::TickInfo tick{.tick = 0, .time_ns = 0, .period_ns = 10 * ms, .run = 0};
  task.latch(tick);
  task.step(tick);
  EXPECT_EQ(module_.in.value, 10.0);
  EXPECT_TRUE(module_.in.fresh);
}

TEST_F(ModuleTasks, QueuedReleaseReadsTheInputsAndTheVersionOfItsTick) {
  const executive::TickInfo running{.tick = 10, .time_ns = 10 * ms, .period_ns = 10 * ms, .run = 1};
  const executive::TickInfo queued{.tick = 20, .time_ns = 20 * ms, .period_ns = 10 * ms, .run = 2};
  const executive::TickInfo next{.tick = 30, .time_ns = 30 * ms, .period_ns = 10 * ms, .run = 3};
  table_.write(source_, 1.0, 10 * ms);
  database_.version = 41;
  task_.latch(running);
  table_.write(source_, 2.0, 20 * ms);
  database_.version = 42;
  task_.queue(queued);
  table_.write(source_, 3.0, 25 * ms);
  database_.version = 43;
  task_.step(running);
  EXPECT_EQ(module_.seen.version, 41U) << "the running step is not affected";
  EXPECT_DOUBLE_EQ(module_.in.value, 1.0);
  task_.latch(queued);
  task_.step(queued);
  EXPECT_EQ(module_.seen.time_ns, 20 * ms);
  EXPECT_EQ(module_.seen.version, 42U) << "rows of later versions are valid only after its time";
  EXPECT_DOUBLE_EQ(module_.in.value, 2.0);
  task_.latch(next);
  task_.step(next);
  EXPECT_EQ(module_.seen.version, 43U);
  EXPECT_DOUBLE_EQ(module_.in.value, 3.0);
}

TEST_F(ModuleTasks, CountRunsWithoutAnAnswer) {
  task_.step({});
  EXPECT_EQ(task_.runs_without_result(), 0U);
  module_.queried = &database_;
  database_.outcome.status = rtstdb::Status::bad_input;
  task_.step({});
  database_.outcome.status = rtstdb::Status::missed;
  task_.step({});
  database_.outcome.status = rtstdb::Status::late;
  task_.step({});
  EXPECT_EQ(task_.runs_without_result(), 2U) << "a late transaction is done";
  EXPECT_EQ(task_.first_failure(), rtstdb::Status::bad_input);
}

/// A firm transaction that is late has no result, so its run counts among those without one.
TEST_F(ModuleTasks, CountRunsThatAFirmTransactionDiscards) {
  ModuleTask task("module m", module_, {.inputs = {{}, {}}, .outputs = {out_, untouched_}}, 5 * ms, table_,
                  &database_, clock_, events_, true);
  module_.queried = &database_;
  rtstdb::Outcome& outcome = database_.outcome;
  outcome.deadline_class = rtstdb::DeadlineClass::firm;
  outcome.status = rtstdb::Status::committed;
  task.step({});
  EXPECT_EQ(module_.seen.read_class, rtstdb::DeadlineClass::firm);
  EXPECT_EQ(task.discarded_runs(), 0U);
  outcome.status = rtstdb::Status::missed;
  task.step({});
  outcome.status = rtstdb::Status::refused;
  outcome.refused_by = rtstdb::RefusedBy::admission;
  task.step({});
  EXPECT_EQ(task.discarded_runs(), 2U);
  outcome.refused_by = rtstdb::RefusedBy::none;
  outcome.status = rtstdb::Status::device_lost;
  task.step({});
  EXPECT_EQ(task.discarded_runs(), 2U) << "it was not its deadline";
  EXPECT_EQ(task.runs_without_result(), 3U);
  EXPECT_EQ(task.first_failure(), rtstdb::Status::missed);
  task_.step({});
  EXPECT_EQ(module_.seen.read_class, rtstdb::DeadlineClass::soft) << "without the key";
}

TEST_F(ModuleTasks, CountRunsWithALateHardTransaction) {
  module_.queried = &database_;
  rtstdb::Outcome& outcome = database_.outcome;
  outcome.status = rtstdb::Status::late;
  const auto run = [&](std::uint64_t tick, std::int64_t submitted, std::int64_t started,
                       std::int64_t published, std::int64_t lateness) {
    outcome.submitted = rtstdb::clock_time_ns(submitted);
    outcome.started = rtstdb::clock_time_ns(started);
    outcome.published = rtstdb::clock_time_ns(published);
    outcome.lateness = rtstdb::Nanoseconds(lateness);
    task_.step({.tick = tick});
  };
  run(1, 0, 10, 100, 20);
  EXPECT_EQ(task_.hard_misses(), 0U) << "a soft one may be late";
  outcome.deadline_class = rtstdb::DeadlineClass::hard;
  run(2, 0, 10, 100, 20);
  run(3, 0, 80, 100, 30);
  run(4, 90, 91, 100, 15);
  outcome.interrupted = rtstdb::Nanoseconds(70);
  run(5, 0, 10, 100, 5);
  EXPECT_EQ(task_.hard_misses(), 4U);
  std::vector<std::string> misses;
  for (const ModuleTask::HardMiss& miss : task_.first_hard_misses())
    misses.push_back(std::to_string(miss.tick) + " " + miss.cause);
  EXPECT_EQ(misses, (std::vector<std::string>{"2 own work", "3 waited for other transactions",
                                              "4 submitted after its deadline",
                                              "5 interrupted by other transactions"}));
  EXPECT_EQ(task_.worst_hard_miss().tick, 3U);
  for (std::uint64_t tick = 6; tick < 50; ++tick)
    run(tick, 0, 10, 100, 5);
  EXPECT_EQ(task_.hard_misses(), 48U);
  EXPECT_EQ(task_.first_hard_misses().size(), 20U) << "the others are counted";
  EXPECT_EQ(task_.runs_without_result(), 0U);
}

TEST_F(ModuleTasks, UseCopiesOfTheSignalsBetweenLatchAndPublish) {
  const executive::TickInfo tick{.tick = 0, .time_ns = 0, .period_ns = ms, .run = 0};
  table_.write(source_, 10.0, 0);
  task_.latch(tick);
  table_.write(source_, 99.0, ms);
  task_.step(tick);
  EXPECT_DOUBLE_EQ(module_.in.value, 10.0);
  EXPECT_TRUE(module_.in.fresh);
  EXPECT_DOUBLE_EQ(table_.value(out_), 3.0) << "visible before it was published";
  task_.publish(tick);
  EXPECT_DOUBLE_EQ(table_.value(out_), 11.0);
  EXPECT_TRUE(table_.read(out_).fresh);
  EXPECT_EQ(table_.read(out_).time_ns, 0);
  EXPECT_DOUBLE_EQ(table_.value(untouched_), 4.0);
}

TEST_F(ModuleTasks, UnconnectedInputsReadTheirInitialValueAndAreNotFresh) {
  task_.latch({});
  task_.step({});
  EXPECT_DOUBLE_EQ(module_.open.value, 7.5);
  EXPECT_FALSE(module_.open.fresh);
  EXPECT_FALSE(module_.in.fresh) << "connected, but never written";
}

TEST_F(ModuleTasks, AnInputWhoseSignalIsUnknownKeepsItsValueAndIsNotFresh) {
  table_.write(source_, 5.0, 0);
  task_.latch({});
  table_.write(source_, std::nan(""), ms);
  task_.latch({});
  task_.step({});
  EXPECT_EQ(module_.in.value, 5.0);
  EXPECT_FALSE(module_.in.fresh);
  task_.queue({});
  task_.latch({});
  task_.step({});
  EXPECT_EQ(module_.in.value, 5.0) << "in a queued release too";
  table_.write(source_, 6.0, ms);
  task_.latch({});
  task_.step({});
  EXPECT_EQ(module_.in.value, 6.0);
  EXPECT_TRUE(module_.in.fresh);
}

TEST_F(ModuleTasks, NoteThatTheyReadWhenTheyLatchOrQueue) {
  test::CountedReads of_source, of_output;
  table_.add_read_observer(source_, of_source);
  table_.add_read_observer(out_, of_output);
  ModuleTask task("module m", module_, {.inputs = {{.signal = source_}, {}}, .outputs = {out_, untouched_}},
                  5 * ms, table_, nullptr, clock_, events_);
  task.latch({});
  EXPECT_EQ(of_source.count, 1);
  task.queue({});
  EXPECT_EQ(of_source.count, 2);
  task.latch({});
  EXPECT_EQ(of_source.count, 2) << "it takes what queue() has read";
  task.step({});
  EXPECT_EQ(of_output.count, 0);
}

TEST_F(ModuleTasks, CountTheStepsThatAFaultMakesLonger) {
  task_.step({});
  EXPECT_EQ(task_.added_ns(), 0);
  EXPECT_EQ(task_.longer_steps(), 0u);
  task_.add_duration(2 * ms);
  task_.step({});
  EXPECT_EQ(task_.added_ns(), 2 * ms);
  task_.add_duration(-2 * ms);
  task_.step({});
  EXPECT_EQ(task_.added_ns(), 0);
  EXPECT_EQ(task_.longer_steps(), 1u);
}

TEST_F(ModuleTasks, OfARunWithoutADatabaseHaveNoVersion) {
  ModuleTask task("module m", module_, {.inputs = {{.signal = source_}, {}}, .outputs = {out_, untouched_}},
                  5 * ms, table_, nullptr, clock_, events_);
  task.latch({});
  task.queue({});
  task.step({});
  EXPECT_EQ(module_.seen.version, 0U);
}

TEST_F(ModuleTasks, AreNotSteppedAgainAfterAThrow) {
  executive::TickInfo tick{.tick = 7, .time_ns = 70 * ms, .period_ns = 10 * ms, .run = 0};
  module_.throws = true;
  task_.latch(tick);
  task_.step(tick);
  task_.publish(tick);
  EXPECT_TRUE(task_.has_failed());
  EXPECT_EQ(
      task_.fault(),
      "module m threw in its step of tick 7: the pump is dry; its outputs are unknown from then on, and "
      "the run ended");
  EXPECT_TRUE(std::isnan(table_.value(out_)));
  EXPECT_TRUE(std::isnan(table_.value(untouched_)));
  module_.throws = false;
  tick.run = 1;
  task_.latch(tick);
  task_.step(tick);
  task_.publish(tick);
  EXPECT_EQ(module_.steps, 1);
  EXPECT_TRUE(std::isnan(table_.value(out_)));
}

TEST_F(ModuleTasks, OutputsKeepTheValuesOfTheLastRun) {
  task_.latch({});
  task_.step({});
  EXPECT_DOUBLE_EQ(module_.out_before, 3.0);
  table_.write(source_, 10.0, 0);
  task_.latch({});
  task_.step({});
  EXPECT_DOUBLE_EQ(module_.out_before, 1.0);
}

TEST_F(ModuleTasks, PassOnTheTimesThatTheModuleMeasured) {
  task_.step({});
  task_.step({});
  EXPECT_EQ(task_.last_blocked_ns(), 11);
  EXPECT_EQ(task_.last_gpu_ns(), 5);
}

TEST_F(ModuleTasks, WaitForATransactionUntilItEnds) {
  module_.queried = &database_;
  rtstdb::Outcome& outcome = database_.outcome;
  clock_.set_origin(1'000 * ms);
  const executive::TickInfo tick{.tick = 20, .time_ns = 20 * ms, .period_ns = 10 * ms, .run = 2};
  const auto blocked = [&](rtstdb::Status status) {
    outcome.status = status;
    task_.latch(tick);
    task_.step(tick);
    return task_.last_blocked_ns() - 11;
  };
  outcome.submitted = rtstdb::clock_time_ns(1'021 * ms);
  outcome.published = rtstdb::clock_time_ns(1'024 * ms);
  EXPECT_EQ(blocked(rtstdb::Status::committed), 3 * ms);
  outcome.published = {};
  outcome.lateness = rtstdb::Nanoseconds(2 * ms);
  EXPECT_EQ(blocked(rtstdb::Status::missed), 6 * ms) << "the deadline is at 1025 ms";
  EXPECT_EQ(blocked(rtstdb::Status::refused), 0);
}

}  // namespace
}  // namespace hil::run
