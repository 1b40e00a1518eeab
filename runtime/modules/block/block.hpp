#pragma once
// The compiled equations of a block, and their values from step to step.
//
// A step at the instant t:
//   1. variables are computed from the states and the inputs at t
//   2. in the first step the initial states of the machines are entered
//   3. resets: a state whose condition is true takes its value
//   4. each machine makes at most one transition: the first of its state whose guard is true. Its new state's
//      entry actions are computed in their order
//   5. if 2 to 4 changed a state, variables are computed again; functions with a memory are not advanced
//   6. outputs are those of t
//   7. the states advance to the next step, with the inputs of t, and stay within their limits
//
// A value that can not be computed (0 / 0, or beyond the numbers) is unknown, NaN, and so is what depends on
// it; a state stays unknown until a reset or an entry action sets it.
//
// Threads: one at a time. step neither allocates nor blocks.

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runtime/expression/program.hpp"

namespace hil::modules {

using expression::Program;

/// An equation whose result has a place among the values.
struct BlockEquation {
  std::uint32_t value = 0;
  Program program;
};

struct BlockReset {
  Program when, to;
};

struct BlockState {
  std::string name;
  std::uint32_t value = 0;
  double initial = 0.0;
  double unit_per_derivative = 1.0;  ///< a derivative in K/s, of a state in degF
  std::optional<Program> derivative{}, next{};
  std::optional<Program> min{}, max{};
  std::optional<BlockReset> reset{};
};

struct BlockTransition {
  std::uint32_t to = 0;
  std::optional<Program> when, after;  ///< after: a time in seconds in the state
};

struct BlockMachineState {
  std::string name;
  std::vector<BlockEquation> entry{};
  std::vector<BlockTransition> transitions{};
};

struct BlockMachine {
  std::string name;
  bool has_events = true;
  std::uint32_t initial = 0;
  std::uint32_t value = 0;  ///< the index of its state
  std::uint32_t time = 0;   ///< value: seconds in its state
  std::vector<BlockMachineState> states{};
};

struct BlockOutput {
  std::uint32_t value = 0;
  std::optional<Program> program;  ///< empty: the value itself
};

/// A compiled block. Its values: by the indices that the parts have, `initial_values` before the first step.
struct BlockEquations {
  bool runge_kutta = true;                                       ///< else Euler
  std::vector<std::shared_ptr<const expression::Table>> tables;  ///< that the programs call
  std::vector<double> initial_values;
  std::vector<BlockEquation> variables;  ///< each after those that it reads
  std::vector<BlockState> states;
  std::vector<BlockMachine> machines;
  std::vector<BlockOutput> outputs;
};

class Block {
 public:
  /// `period_ns`: from one step to the next.
  Block(BlockEquations equations, std::int64_t period_ns);

  /// The inputs' values, and whatever else comes before the states.
  std::span<double> values() noexcept { return values_; }
  void step(std::int64_t time_ns, std::span<double> outputs) noexcept;

  const BlockEquations& equations() const noexcept { return equations_; }
  /// By machine: the state that was entered in the last step, if one was.
  std::span<const std::optional<std::uint32_t>> entered() const noexcept { return entered_; }
  double state(std::size_t index) const noexcept { return values_[equations_.states[index].value]; }

 private:
  void compute_variables(double time_s, bool is_step) noexcept;
  void enter(std::size_t machine, std::uint32_t state, std::int64_t time_ns) noexcept;
  bool enter_first_states(std::int64_t time_ns) noexcept;
  bool apply_resets(double time_s) noexcept;
  bool make_transitions(std::int64_t time_ns) noexcept;
  bool permits(BlockTransition& transition, std::int64_t in_state_ns, double time_s) noexcept;
  void begin_guards(std::int64_t time_ns) noexcept;
  void compute_derivatives(double time_s, bool is_step, std::vector<double>& derivatives) noexcept;
  void move_states(const std::vector<double>& derivatives, double duration_s) noexcept;
  void advance(double time_s) noexcept;

  BlockEquations equations_;
  const double period_s_;
  bool is_first_ = true;
  std::vector<double> values_;
  std::vector<std::int64_t> entered_ns_;  ///< by machine
  std::vector<std::optional<std::uint32_t>> entered_;
  struct Range {
    double min = -std::numeric_limits<double>::infinity(), max = std::numeric_limits<double>::infinity();
  };
  std::vector<Range> ranges_;         ///< by state
  std::vector<double> begin_, next_;  ///< by state: at the begin of a step, and by `next`
  std::vector<double> k_[4];          ///< by state: the derivatives of the stages
};

}  // namespace hil::modules
