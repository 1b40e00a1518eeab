#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <hil/world/world_module.hpp>

#include "runtime/config/parse.hpp"
#include "runtime/modules/named_world.hpp"
#include "runtime/modules/registry.hpp"
#include "runtime/modules/run_events.hpp"
#include "tests/gpu/runtime/collected_files.hpp"
#include "tests/support/allocation_guard.hpp"

namespace hil::modules::test {

/// A world on a database, and modules in it.
class ModuleFixture : public ::testing::Test {
 protected:
  explicit ModuleFixture(std::vector<std::string> layers) : layers_(std::move(layers)) {}

  void SetUp() override {
    auto opened = rtstdb::Database::open({});
    ASSERT_TRUE(opened) << opened.error().message;
    database_ = std::move(opened).value();
    world_ = std::make_unique<NamedWorld>(database_.get(), layers_);
  }

  /// Empty when the parameters are refused.
  std::unique_ptr<AnyModule> make(const ModuleType& type, const std::string& parameters,
                                  const TaskParameters& task) {
    const auto value = config::parse_text("test", parameters, type.parameters, diagnostics_);
    if (!value) return nullptr;
    auto module = type.create(*value, task, diagnostics_);
    TaskParameters of_run = task;
    if (of_run.tick_ns == 0) of_run.tick_ns = task.period_ns;
    module->world_module()->configure(*world_, {.task = of_run, .events = events_, .files = files_});
    return module;
  }
  /// The outputs of one step, whose heap traffic allocation_guard counts. `inputs`: one value for each, or
  /// none for those without a signal.
  std::vector<double> step(AnyModule& module, std::uint64_t run, std::int64_t time_ns, std::int64_t period_ns,
                           std::span<const signals::SignalValue> inputs = {}) {
    std::vector<double> outputs(module.ports().outputs.size());
    std::vector<signals::SignalValue> without_signals;
    for (const Port& port : module.ports().inputs)
      without_signals.push_back({.value = port.initial});
    WorldStep context;
    context.run = run;
    context.period_ns = period_ns;
    context.time_ns = time_ns;
    context.deadline = rtstdb::ClockTime::max();
    context.version = database_->latest().version;
    context.inputs = inputs.empty() ? without_signals : inputs;
    context.outputs = outputs;
    context.events = &events_;
    allocation_guard::enter_tick();
    module.world_module()->step(context);
    allocation_guard::leave_tick();
    return outputs;
  }

  const std::vector<std::string> layers_;
  std::unique_ptr<rtstdb::Database> database_;
  std::unique_ptr<NamedWorld> world_;
  RunEvents events_;
  CollectedFiles files_;
  config::Diagnostics diagnostics_;
};

}  // namespace hil::modules::test
