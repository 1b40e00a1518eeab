#include "bench/executive/block_step.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <hil/module.hpp>

#include "bench/figure/figure.hpp"
#include "runtime/config/parse.hpp"
#include "runtime/modules/registry.hpp"
#include "runtime/modules/run_events.hpp"

namespace hil::bench {
namespace {

constexpr std::int64_t period_ns = 1'000'000;
constexpr int states = 10;

std::string block_text() {
  std::ostringstream text;
  text << "{inputs: {u: {unit: m, initial: 1}}, parameters: {t: 100 ms}, variables: {drive: 2 * u}, "
          "states: {x0: {unit: m, derivative: (drive - x0) / t}";
  for (int i = 1; i < states; ++i)
    text << ", x" << i << ": {unit: m, derivative: (x" << i - 1 << " - x" << i << ") / t}";
  text << "}}";
  return text.str();
}

/// The last of ten lags at `time` in time constants, for a step to 2: 2 (1 - e^-t sum t^k / k!).
double exact_last(double time) {
  double sum = 0.0, term = 1.0;
  for (int k = 0; k < states; ++k) {
    sum += term;
    term *= time / (k + 1);
  }
  return 2.0 * (1.0 - std::exp(-time) * sum);
}

/// A block writes none.
struct NoFiles final : modules::FileStreams {
  std::unique_ptr<modules::FileStream> open(const modules::FileStreamOptions& /*options*/) override {
    return nullptr;
  }
};

}  // namespace

BlockStepCost measure_block_step(int rounds, std::uint64_t steps_per_round) {
  const modules::ModuleType& type = *modules::find_module_type("block");
  config::Diagnostics diagnostics;
  const auto parameters = config::parse_text("block", block_text(), type.parameters, diagnostics);
  const modules::TaskParameters task{.instance = "block", .period_ns = period_ns};
  auto module = parameters ? type.create(*parameters, task, diagnostics) : nullptr;
  if (module == nullptr) throw std::runtime_error(diagnostics.to_text());
  modules::RunEvents events;
  NoFiles files;
  modules::Module& block = *module->plain_module();
  block.configure({.task = task, .events = events, .files = files});
  std::vector<signals::SignalValue> inputs{{.value = 1.0, .time_ns = 0, .fresh = true}};
  std::vector<double> outputs(module->ports().outputs.size());
  modules::StepContext context;
  context.period_ns = period_ns;
  context.inputs = inputs;
  context.outputs = outputs;
  context.events = &events;

  BlockStepCost cost;
  std::vector<double> rounds_us;
  for (int round = 0; round < rounds; ++round) {
    const auto begin = std::chrono::steady_clock::now();
    for (std::uint64_t i = 0; i < steps_per_round; ++i) {
      context.time_ns = static_cast<std::int64_t>(cost.steps++) * period_ns;
      block.step(context);
    }
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - begin;
    rounds_us.push_back(took.count() / static_cast<double>(steps_per_round));
    const double exact = exact_last(10.0 * 1e-9 * static_cast<double>(context.time_ns));
    if (std::abs(outputs[states - 1] - exact) > 1e-6)
      throw std::runtime_error("the block is at " + std::to_string(outputs[states - 1]) + ", exactly at " +
                               std::to_string(exact));
  }
  cost.median_us = median(std::move(rounds_us));
  return cost;
}

}  // namespace hil::bench
