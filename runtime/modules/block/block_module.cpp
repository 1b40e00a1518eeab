// A block: a plant, a controller or a signal source that a scenario describes by equations.
//
// A release that the executive skips is computed at the next step, with the inputs of the step before it, so
// that the time of the block is the run time.

#include <cmath>
#include <utility>

#include <hil/module.hpp>

#include "runtime/modules/block/block.hpp"
#include "runtime/modules/block/block_schema.hpp"
#include "runtime/modules/block/compile_block.hpp"

namespace hil::modules {
namespace {

class BlockModule final : public Module {
 public:
  BlockModule(CompiledBlock compiled, const TaskParameters& task)
      : block_(std::move(compiled.equations), task.period_ns),
        ports_(std::move(compiled.ports)),
        input_values_(std::move(compiled.input_values)),
        inputs_(compiled.inputs),
        next_ns_(task.offset_ns),
        outputs_(ports_.outputs.size()) {
    // What other modules read before the first step.
    for (std::size_t i = 0; i < ports_.inputs.size(); ++i)
      block_.values()[input_values_[i]] = ports_.inputs[i].initial;
    Block first_step = block_;
    first_step.step(task.offset_ns, outputs_);
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      // An output that is unknown without inputs has no initial value.
      if (!std::isnan(outputs_[i])) ports_.outputs[i].initial = outputs_[i];
    }
  }

  const Ports& ports() const noexcept override { return ports_; }

  void configure(const Setup& setup) override {
    const std::string block = setup.task.instance + ".";
    for (const BlockMachine& machine : block_.equations().machines) {
      entered_.emplace_back();
      for (const BlockMachineState& state : machine.states)
        entered_.back().push_back(setup.events.add_kind(block + machine.name + " is " + state.name));
    }
    for (const BlockState& state : block_.equations().states)
      unknown_.push_back(setup.events.add_kind(block + state.name +
                                               " is unknown from here on: its equations have no "
                                               "finite value"));
    is_unknown_.resize(unknown_.size());
  }

  void step(StepContext& context) noexcept override {
    for (; next_ns_ < context.time_ns; next_ns_ += context.period_ns)
      step_at(next_ns_, *context.events);
    for (std::size_t i = 0; i < context.inputs.size(); ++i) {
      block_.values()[input_values_[i]] = context.inputs[i].value;
      if (i < inputs_) block_.values()[input_values_[i] + 1] = context.inputs[i].fresh ? 1.0 : 0.0;
    }
    step_at(context.time_ns, *context.events);
    std::copy(outputs_.begin(), outputs_.end(), context.outputs.begin());
    next_ns_ = context.time_ns + context.period_ns;
  }

 private:
  void step_at(std::int64_t time_ns, EventLog& events) noexcept {
    block_.step(time_ns, outputs_);
    for (std::size_t i = 0; i < entered_.size(); ++i) {
      const auto state = block_.entered()[i];
      if (state && block_.equations().machines[i].has_events) events.note(entered_[i][*state], time_ns);
    }
    for (std::size_t i = 0; i < unknown_.size(); ++i) {
      const bool is_unknown = std::isnan(block_.state(i));
      if (is_unknown && !is_unknown_[i]) events.note(unknown_[i], time_ns);
      is_unknown_[i] = is_unknown;
    }
  }

  Block block_;
  Ports ports_;
  const std::vector<std::uint32_t> input_values_;  ///< by input of the ports
  const std::size_t inputs_;                       ///< those that have a freshness; the others are parameters
  std::int64_t next_ns_ = 0;                       ///< the next step
  std::vector<double> outputs_;
  std::vector<std::vector<EventLog::Kind>> entered_;  ///< by machine and state
  std::vector<EventLog::Kind> unknown_;               ///< by state
  std::vector<char> is_unknown_;                      ///< by state
};

}  // namespace

ModuleType block_type() {
  return {
      .name = "block",
      .about = "A plant, a controller or a signal source, described by equations, tables and state machines.",
      .parameters = block_schema(),
      .create = [](const config::Value& parameters, const TaskParameters& task,
                   config::Diagnostics& diagnostics) -> std::unique_ptr<AnyModule> {
        auto compiled = compile_block(parameters, task, diagnostics);
        if (!compiled) return nullptr;
        return std::make_unique<BlockModule>(std::move(*compiled), task);
      }};
}

}  // namespace hil::modules
