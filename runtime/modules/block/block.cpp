#include "runtime/modules/block/block.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hil::modules {
namespace {

double seconds(std::int64_t time_ns) noexcept {
  return static_cast<double>(time_ns) / 1e9;
}

}  // namespace

Block::Block(BlockEquations equations, std::int64_t period_ns)
    : equations_(std::move(equations)),
      period_s_(seconds(period_ns)),
      values_(equations_.initial_values),
      entered_ns_(equations_.machines.size()),
      entered_(equations_.machines.size()),
      ranges_(equations_.states.size()),
      begin_(equations_.states.size()),
      next_(equations_.states.size()) {
  for (std::vector<double>& stage : k_)
    stage.resize(equations_.states.size());
}

void Block::step(std::int64_t time_ns, std::span<double> outputs) noexcept {
  const double time_s = seconds(time_ns);
  std::ranges::fill(entered_, std::nullopt);
  for (std::size_t i = 0; i < equations_.machines.size(); ++i)
    values_[equations_.machines[i].time] = is_first_ ? 0.0 : seconds(time_ns - entered_ns_[i]);
  compute_variables(time_s, true);
  bool changed = std::exchange(is_first_, false) && enter_first_states(time_ns);
  changed = apply_resets(time_s) || changed;
  changed = make_transitions(time_ns) || changed;
  if (changed) compute_variables(time_s, false);
  begin_guards(time_ns);
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    BlockOutput& output = equations_.outputs[i];
    outputs[i] = output.program ? output.program->evaluate(values_, time_s) : values_[output.value];
  }
  advance(time_s);
}

void Block::compute_variables(double time_s, bool is_step) noexcept {
  for (BlockEquation& variable : equations_.variables) {
    values_[variable.value] = is_step ? variable.program.evaluate(values_, time_s)
                                      : variable.program.evaluate_between_steps(values_, time_s);
  }
}

void Block::enter(std::size_t machine, std::uint32_t state, std::int64_t time_ns) noexcept {
  BlockMachine& entering = equations_.machines[machine];
  BlockMachineState& next = entering.states[state];
  entered_[machine] = state;
  entered_ns_[machine] = time_ns;
  values_[entering.value] = state;
  values_[entering.time] = 0.0;
  for (BlockEquation& action : next.entry)
    values_[action.value] = action.program.evaluate(values_, seconds(time_ns));
}

bool Block::enter_first_states(std::int64_t time_ns) noexcept {
  for (std::size_t i = 0; i < equations_.machines.size(); ++i)
    enter(i, equations_.machines[i].initial, time_ns);
  return !equations_.machines.empty();
}

bool Block::apply_resets(double time_s) noexcept {
  bool changed = false;
  for (BlockState& state : equations_.states) {
    if (!state.reset) continue;
    const double value = state.reset->to.evaluate(values_, time_s);
    if (state.reset->when.evaluate(values_, time_s) != 1.0) continue;
    values_[state.value] = value;
    changed = true;
  }
  return changed;
}

bool Block::permits(BlockTransition& transition, std::int64_t in_state_ns, double time_s) noexcept {
  const bool is_true = !transition.when || transition.when->evaluate(values_, time_s) == 1.0;
  if (!transition.after) return is_true;
  const double after_s = transition.after->evaluate(values_, time_s);
  // An unknown time never passes.
  return is_true && static_cast<double>(in_state_ns) >= std::round(1e9 * after_s);
}

bool Block::make_transitions(std::int64_t time_ns) noexcept {
  bool changed = false;
  for (std::size_t i = 0; i < equations_.machines.size(); ++i) {
    if (entered_[i]) continue;  // its first step
    BlockMachine& machine = equations_.machines[i];
    BlockMachineState& state = machine.states[static_cast<std::size_t>(values_[machine.value])];
    std::optional<std::uint32_t> to;
    // All guards are evaluated, since their functions may have a memory.
    for (BlockTransition& transition : state.transitions) {
      if (permits(transition, time_ns - entered_ns_[i], seconds(time_ns)) && !to) to = transition.to;
    }
    if (!to) continue;
    enter(i, *to, time_ns);
    changed = true;
  }
  return changed;
}

/// The memory of the guards of a state begins in the step in which the state is entered.
void Block::begin_guards(std::int64_t time_ns) noexcept {
  for (std::size_t i = 0; i < equations_.machines.size(); ++i) {
    if (!entered_[i]) continue;
    for (BlockTransition& transition : equations_.machines[i].states[*entered_[i]].transitions) {
      if (transition.when) transition.when->reset();
      if (transition.after) transition.after->reset();
      permits(transition, 0, seconds(time_ns));
    }
  }
}

void Block::compute_derivatives(double time_s, bool is_step, std::vector<double>& derivatives) noexcept {
  for (std::size_t i = 0; i < equations_.states.size(); ++i) {
    BlockState& state = equations_.states[i];
    if (!state.derivative) continue;
    const double derivative = is_step ? state.derivative->evaluate(values_, time_s)
                                      : state.derivative->evaluate_between_steps(values_, time_s);
    derivatives[i] = derivative * state.unit_per_derivative;
  }
}

/// To the values at the begin and so much time with these derivatives.
void Block::move_states(const std::vector<double>& derivatives, double duration_s) noexcept {
  for (std::size_t i = 0; i < equations_.states.size(); ++i) {
    if (equations_.states[i].derivative)
      values_[equations_.states[i].value] = begin_[i] + duration_s * derivatives[i];
  }
}

/// Euler's method, or the classical one of Runge and Kutta of order 4.
void Block::advance(double time_s) noexcept {
  for (std::size_t i = 0; i < equations_.states.size(); ++i) {
    BlockState& state = equations_.states[i];
    begin_[i] = values_[state.value];
    if (state.next) next_[i] = state.next->evaluate(values_, time_s);
    if (state.min) ranges_[i].min = state.min->evaluate(values_, time_s);
    if (state.max) ranges_[i].max = state.max->evaluate(values_, time_s);
  }
  compute_derivatives(time_s, true, k_[0]);
  if (equations_.runge_kutta) {
    constexpr double shares[] = {0.5, 0.5, 1.0};
    for (int stage = 1; stage < 4; ++stage) {
      const double duration_s = shares[stage - 1] * period_s_;
      move_states(k_[stage - 1], duration_s);
      compute_variables(time_s + duration_s, false);
      compute_derivatives(time_s + duration_s, false, k_[stage]);
    }
    for (std::size_t i = 0; i < k_[0].size(); ++i)
      k_[0][i] = (k_[0][i] + 2.0 * k_[1][i] + 2.0 * k_[2][i] + k_[3][i]) / 6.0;
  }
  move_states(k_[0], period_s_);
  for (std::size_t i = 0; i < equations_.states.size(); ++i) {
    double& value = values_[equations_.states[i].value];
    if (equations_.states[i].next) value = next_[i];
    if (!std::isfinite(value)) value = std::numeric_limits<double>::quiet_NaN();
    if (value < ranges_[i].min) value = ranges_[i].min;
    if (value > ranges_[i].max) value = ranges_[i].max;
  }
}

}  // namespace hil::modules
