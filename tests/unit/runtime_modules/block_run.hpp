#pragma once
// A block that is stepped without a run.

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <hil/module.hpp>

#include "runtime/config/parse.hpp"
#include "runtime/modules/registry.hpp"
#include "runtime/modules/run_events.hpp"

namespace hil::modules::test {

inline constexpr std::int64_t ms = 1'000'000;

/// Steps of 10 ms.
inline TaskParameters ten_ms() {
  return {.instance = "b", .period_ns = 10 * ms, .seed = 7};
}

inline std::unique_ptr<AnyModule> create_block(const std::string& yaml, config::Diagnostics& diagnostics,
                                               const TaskParameters& task = ten_ms()) {
  const ModuleType& type = *find_module_type("block");
  const auto parameters = config::parse_text("b.yaml", yaml, type.parameters, diagnostics);
  auto module = parameters ? type.create(*parameters, task, diagnostics) : nullptr;
  EXPECT_EQ(module == nullptr, !diagnostics.empty()) << yaml << diagnostics.to_text();
  return module;
}

/// A block writes none.
struct NoFiles final : FileStreams {
  std::unique_ptr<FileStream> open(const FileStreamOptions& /*options*/) override { return nullptr; }
};

class BlockRun {
 public:
  explicit BlockRun(const std::string& yaml, const TaskParameters& task = ten_ms()) : task_(task) {
    config::Diagnostics diagnostics;
    module_ = create_block(yaml, diagnostics, task);
    if (!module_) throw std::runtime_error(diagnostics.to_text());
    module_->plain_module()->configure({.task = task, .events = events_, .files = no_files_});
    for (const Port& port : module_->ports().inputs)
      inputs_.push_back({.value = port.initial});
    outputs_.resize(module_->ports().outputs.size());
  }

  const Ports& ports() const { return module_->ports(); }
  void set(const std::string& input, double value, bool fresh = true) {
    inputs_.at(index_of(ports().inputs, input)) = {.value = value, .time_ns = 0, .fresh = fresh};
  }
  double operator[](const std::string& output) const {
    return outputs_.at(index_of(ports().outputs, output));
  }

  /// The step at an instant.
  void step_at(std::int64_t time_ns) {
    StepContext context;
    context.time_ns = time_ns;
    context.period_ns = task_.period_ns;
    context.inputs = inputs_;
    context.outputs = outputs_;
    context.events = &events_;
    module_->plain_module()->step(context);
    next_ns_ = time_ns + task_.period_ns;
  }
  void step() { step_at(next_ns_); }
  /// All steps up to an instant, that at the instant too.
  void run_to(std::int64_t time_ns) {
    while (next_ns_ <= time_ns)
      step();
  }
  std::vector<std::string> events() const {
    std::vector<std::string> texts;
    for (const RunEvents::Event& event : events_.events())
      texts.push_back(std::to_string(event.time_ns / ms) + " ms: " + event.text);
    return texts;
  }

 private:
  static std::size_t index_of(const std::vector<Port>& ports, const std::string& name) {
    for (std::size_t i = 0; i < ports.size(); ++i)
      if (ports[i].name == name) return i;
    throw std::runtime_error("no port " + name);
  }

  TaskParameters task_;
  RunEvents events_;
  NoFiles no_files_;
  std::unique_ptr<AnyModule> module_;
  std::vector<signals::SignalValue> inputs_;
  std::vector<double> outputs_;
  std::int64_t next_ns_ = 0;
};

}  // namespace hil::modules::test
