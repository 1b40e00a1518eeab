#include "runtime/expression/function.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace hil::expression {
namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

double truth(bool value) {
  return value ? 1.0 : 0.0;
}
double argument(const Call& call, std::size_t i, double otherwise) {
  return i < call.arguments.size() ? call.arguments[i] : otherwise;
}
/// True only if it is known to be.
bool is_true(double value) {
  return value == 1.0;
}

/// Notes that the memory has begun if `x` is known. Returns whether this is the first such step. Before it
/// the result is unknown.
bool note_known(double& has_begun, double x) {
  if (has_begun != 0.0 || std::isnan(x)) return false;
  has_begun = 1.0;
  return true;
}

// Without a state.

double absolute(const Call& c) noexcept {
  return std::abs(c.arguments[0]);
}
double least(const Call& c) noexcept {
  double result = c.arguments[0];
  for (const double value : c.arguments)
    result = std::isnan(value) || value < result ? value : result;
  return result;
}
double greatest(const Call& c) noexcept {
  double result = c.arguments[0];
  for (const double value : c.arguments)
    result = std::isnan(value) || value > result ? value : result;
  return result;
}
double clamped(const Call& c) noexcept {
  const double x = c.arguments[0], low = c.arguments[1], high = c.arguments[2];
  if (std::isnan(x) || std::isnan(low) || std::isnan(high) || low > high) return unknown;
  return x < low ? low : x > high ? high : x;
}
double root(const Call& c) noexcept {
  return std::sqrt(c.arguments[0]);
}
double exponential(const Call& c) noexcept {
  return std::exp(c.arguments[0]);
}
double logarithm(const Call& c) noexcept {
  return std::log(c.arguments[0]);
}
double decimal_logarithm(const Call& c) noexcept {
  return std::log10(c.arguments[0]);
}
double sine(const Call& c) noexcept {
  return std::sin(c.arguments[0]);
}
double cosine(const Call& c) noexcept {
  return std::cos(c.arguments[0]);
}
double tangent(const Call& c) noexcept {
  return std::tan(c.arguments[0]);
}
double arc_sine(const Call& c) noexcept {
  return std::asin(c.arguments[0]);
}
double arc_cosine(const Call& c) noexcept {
  return std::acos(c.arguments[0]);
}
double arc_tangent(const Call& c) noexcept {
  return std::atan(c.arguments[0]);
}
double angle_of(const Call& c) noexcept {
  return std::atan2(c.arguments[0], c.arguments[1]);
}
double hypotenuse(const Call& c) noexcept {
  return std::hypot(c.arguments[0], c.arguments[1]);
}
double sign(const Call& c) noexcept {
  const double x = c.arguments[0];
  return std::isnan(x) ? unknown : x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0;
}
double floor_of(const Call& c) noexcept {
  return std::floor(c.arguments[0]);
}
double ceiling_of(const Call& c) noexcept {
  return std::ceil(c.arguments[0]);
}
double rounded(const Call& c) noexcept {
  return std::round(c.arguments[0]);
}
double remainder_of(const Call& c) noexcept {
  const double x = c.arguments[0], by = c.arguments[1];
  return x - by * std::floor(x / by);
}
double is_known(const Call& c) noexcept {
  return truth(!std::isnan(c.arguments[0]));
}

// With a state. It begins with the first known argument: state[0] is 1 from then on. While an argument is
// unknown, so is the result; where the argument is known again, the function goes on from its last state.

/// state[1]: the last known value.
double previous(const Call& c) noexcept {
  const double x = c.arguments[0];
  if (std::isnan(x)) return unknown;
  const double before = note_known(c.state[0], x) ? argument(c, 1, x) : c.state[1];
  c.state[1] = x;
  return before;
}

/// state[1]: the number of the last step, in periods. After it a ring of the values of the last periods, by
/// number of the step. A step that the run skipped has the value before it, and a frame between two steps
/// belongs to the later one.
double delayed(const Call& c) noexcept {
  const double x = c.arguments[0];
  const std::span<double> ring = c.state.subspan(2);
  if (ring.size() < 2) return x;
  const auto place = [&](double number) {
    return static_cast<std::size_t>(std::fmod(number, static_cast<double>(ring.size())));
  };
  // Times are whole nanoseconds, so a time that is a step is not above it by more than rounding.
  const double now = std::ceil(c.time_s / c.constants.period_s - 1e-6);
  if (note_known(c.state[0], x)) {
    std::ranges::fill(ring, argument(c, 2, x));
    c.state[1] = now;
  }
  if (c.state[0] == 0.0) return unknown;
  const double held = ring[place(c.state[1])];
  const double oldest_needed = now - static_cast<double>(ring.size()) + 1.0;
  for (double number = std::max(c.state[1] + 1.0, oldest_needed); number < now; number += 1.0)
    ring[place(number)] = held;
  ring[place(now)] = x;
  c.state[1] = now;
  return ring[place(now + 1.0)];
}

/// The exact answer of a first-order lag to an input that stays what it is until the next step. state[1]: the
/// result; state[2]: the argument, unknown where it was.
double lagged(const Call& c) noexcept {
  const double x = c.arguments[0], time_constant_s = c.arguments[1];
  if (note_known(c.state[0], x)) {
    c.state[1] = argument(c, 2, x);
    c.state[2] = unknown;
  }
  if (c.state[0] == 0.0) return unknown;
  const double share = time_constant_s > 0.0 ? -std::expm1(-c.elapsed_s / time_constant_s) : 1.0;
  if (!std::isnan(c.state[2])) c.state[1] += share * (c.state[2] - c.state[1]);
  c.state[2] = x;
  return std::isnan(x) ? unknown : c.state[1];
}

/// state[1]: the result; state[2]: the argument, which a step that the run skipped has too.
double rate_limited(const Call& c) noexcept {
  const double x = c.arguments[0];
  const double up = std::abs(c.arguments[1]), down = std::abs(argument(c, 2, c.arguments[1]));
  const auto move = [&](double target, double duration_s) {
    c.state[1] += std::clamp(target - c.state[1], -down * duration_s, up * duration_s);
  };
  if (std::isnan(x) || std::isnan(up) || std::isnan(down)) {
    c.state[2] = unknown;
    return unknown;
  }
  if (note_known(c.state[0], x)) {
    c.state[1] = x;
  } else {
    const double skipped_s = c.elapsed_s - c.constants.period_s;
    if (skipped_s > 0.0 && !std::isnan(c.state[2])) move(c.state[2], skipped_s);
    move(x, std::min(c.elapsed_s, c.constants.period_s));
  }
  c.state[2] = x;
  return c.state[1];
}

double hysteresis(const Call& c) noexcept {
  const double x = c.arguments[0], low = c.arguments[1], high = c.arguments[2];
  if (std::isnan(x) || std::isnan(low) || std::isnan(high)) return unknown;
  if (note_known(c.state[0], x)) c.state[1] = truth(x >= high);
  if (x >= high) c.state[1] = 1.0;
  if (x <= low) c.state[1] = 0.0;
  return c.state[1];
}

/// A condition becomes true where it is true, and was last known to be false or was never known. state[1]:
/// its last known truth.
double rises(const Call& c) noexcept {
  const double now = c.arguments[0];
  if (std::isnan(now)) return unknown;
  const bool is_first = note_known(c.state[0], now);
  const bool is_edge = is_true(now) && (is_first || c.state[1] == 0.0);
  c.state[1] = now;
  return truth(is_edge);
}
double falls(const Call& c) noexcept {
  const double now = c.arguments[0];
  if (std::isnan(now)) return unknown;
  const bool is_edge = now == 0.0 && c.state[1] == 1.0;
  c.state[1] = now;
  return truth(is_edge);
}
double changes(const Call& c) noexcept {
  const double now = c.arguments[0];
  if (std::isnan(now)) return unknown;
  const bool is_edge = !note_known(c.state[0], now) && now != c.state[1];
  c.state[1] = now;
  return truth(is_edge);
}

/// state[1]: the last known truth; state[2]: the count; state[3]: whether events may be missing in it.
double counted(const Call& c) noexcept {
  const double reset = argument(c, 1, 0.0);
  const double edge = rises(c);
  if (c.state[0] == 0.0) return unknown;
  if (is_true(edge)) c.state[2] += 1.0;
  if (std::isnan(edge)) c.state[3] = 1.0;
  if (std::isnan(reset)) {
    c.state[2] = 0.0;
    c.state[3] = 1.0;
  }
  if (is_true(reset)) c.state[2] = c.state[3] = 0.0;
  if (std::isnan(edge) || std::isnan(reset)) return unknown;
  c.is_lower_bound = c.state[3] != 0.0;
  return c.state[2];
}

/// state[1]: the result: `set`, or what it was, but not `reset`, in three-valued logic.
double latched(const Call& c) noexcept {
  const double set = c.arguments[0], reset = c.arguments[1];
  if (note_known(c.state[0], set)) c.state[1] = 0.0;
  if (c.state[0] == 0.0) return unknown;
  double& latch = c.state[1];
  if (is_true(set) && !is_true(latch)) latch = 1.0;
  if (std::isnan(set) && !is_true(latch)) latch = unknown;
  if (is_true(reset)) latch = 0.0;
  if (std::isnan(reset) && latch != 0.0) latch = unknown;
  return latch;
}

double held(const Call& c) noexcept {
  const double x = c.arguments[0], when = c.arguments[1];
  if (note_known(c.state[0], x) || (is_true(when) && !std::isnan(x))) c.state[1] = x;
  const bool is_unknown = c.state[0] == 0.0 || std::isnan(when) || (is_true(when) && std::isnan(x));
  return is_unknown ? unknown : c.state[1];
}

/// After a gap a lower bound, until the condition is known to be false. state[1]: whether it is true;
/// state[2]: the run time at which it became true, or was known again; state[3]: whether it may have been
/// true before.
double time_true(const Call& c) noexcept {
  const double now = c.arguments[0];
  note_known(c.state[0], now);
  if (!is_true(now)) {
    c.state[1] = 0.0;
    c.state[3] = std::isnan(now) ? c.state[0] : 0.0;
    return std::isnan(now) ? unknown : 0.0;
  }
  c.is_lower_bound = c.state[3] != 0.0;
  if (c.state[1] == 0.0) c.state[2] = c.time_s;
  c.state[1] = 1.0;
  return std::round((c.time_s - c.state[2]) * 1e9) / 1e9;  // times are whole nanoseconds
}

/// state[1]: the sum; state[2]: the argument, which it keeps until the next step.
double integral(const Call& c) noexcept {
  const double x = c.arguments[0], reset = argument(c, 1, 0.0);
  if (note_known(c.state[0], x)) c.state[2] = 0.0;
  if (c.state[0] == 0.0) return unknown;
  c.state[1] += c.state[2] * c.elapsed_s;
  if (std::isnan(reset)) c.state[1] = unknown;
  if (is_true(reset)) c.state[1] = 0.0;
  c.state[2] = x;
  return std::isnan(x) ? unknown : c.state[1];
}

/// The change per second from one instant at which all signals of x are written since the last one to the
/// next. state[0] to state[3]: whether there was one, the value there, the time at which its newest signal
/// was written, and the latest slope.
double slope(const Call& c, double x, std::span<double> state) noexcept {
  if (std::isnan(x)) return unknown;
  if (!c.written) {
    const double change = note_known(state[0], x) ? 0.0 : x - state[1];
    state[1] = x;
    return change / c.constants.period_s;
  }
  if (note_known(state[0], x)) {
    state[3] = unknown;
  } else if (c.written->oldest_s > state[2] && c.written->newest_s > state[2]) {
    state[3] = (x - state[1]) / (c.written->newest_s - state[2]);
  } else {
    return state[3];
  }
  state[1] = x;
  state[2] = c.written->newest_s;
  return state[3];
}
double derivative(const Call& c) noexcept {
  return slope(c, c.arguments[0], c.state);
}

/// The integral stops where the output is at a limit and the error would take it further. state[0]: the
/// integral; state[1]: its growth per second until the next step; then the state of slope().
double pid(const Call& c) noexcept {
  const double error = c.arguments[0], kp = c.arguments[1], ki = c.arguments[2], kd = c.arguments[3];
  const double low = c.arguments[4], high = c.arguments[5];
  c.state[0] += c.state[1] * c.elapsed_s;
  c.state[1] = 0.0;
  if (std::isnan(error) || std::isnan(low) || std::isnan(high) || low > high) return unknown;
  const double error_slope = slope(c, error, c.state.subspan(2));
  const double output = kp * error + c.state[0] + (kd == 0.0 ? 0.0 : kd * error_slope);
  if (std::isnan(output)) return unknown;
  const double growth = ki * error;
  if ((output < high || growth < 0.0) && (output > low || growth > 0.0)) c.state[1] = growth;
  return std::clamp(output, low, high);
}

/// A value in [0, 1) of the seed and the count in state[0] (Steele, Lea, Flood, "Fast splittable pseudorandom
/// number generators", 2014).
double next_uniform(const Call& c) {
  const auto count = static_cast<std::uint64_t>(c.state[0]);
  c.state[0] += 1.0;
  std::uint64_t x = c.constants.seed + (count + 1) * 0x9E3779B97F4A7C15u;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1p-53;
}
double uniform_noise(const Call& c) noexcept {
  return c.arguments[0] + (c.arguments[1] - c.arguments[0]) * next_uniform(c);
}
/// Box and Muller, 1958.
double normal_noise(const Call& c) noexcept {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - next_uniform(c)));
  return c.arguments[0] * radius * std::cos(2.0 * std::numbers::pi * next_uniform(c));
}

// Limits of constant arguments. A comparison with NaN is false.

template <std::size_t low>
std::string_view problem_of_limits(std::span<const double> arguments) {
  return arguments[low] > arguments[low + 1] ? "its low is above its high" : std::string_view();
}
std::string_view problem_of_time_constant(std::span<const double> arguments) {
  return arguments[1] < 0.0 ? "its time constant is below 0" : std::string_view();
}
/// A falling rate of 0 holds the greatest value.
std::string_view problem_of_rate(std::span<const double> arguments) {
  if (arguments[1] <= 0.0) return "its rate is not above 0";
  return arguments.size() > 2 && arguments[2] < 0.0 ? "its falling rate is below 0" : std::string_view();
}
std::string_view problem_of_deviation(std::span<const double> arguments) {
  return arguments[0] < 0.0 ? "its deviation is below 0" : std::string_view();
}

constexpr Function table[] = {
    {.name = "abs",
     .signature = "q:q",
     .needs_absolute_zero = true,
     .value = absolute,
     .arguments = "x",
     .about = "The absolute value."},
    {.name = "min", .signature = "qq+:q", .value = least, .arguments = "x, y, ...", .about = "The smallest."},
    {.name = "max",
     .signature = "qq+:q",
     .value = greatest,
     .arguments = "x, y, ...",
     .about = "The largest."},
    {.name = "clamp",
     .signature = "qqq:q",
     .value = clamped,
     .problem = problem_of_limits<1>,
     .arguments = "x, low, high",
     .about = "x, but at least low and at most high."},
    {.name = "sqrt", .signature = "r:R", .value = root, .arguments = "x", .about = "The square root."},
    {.name = "exp", .signature = "n:1", .value = exponential, .arguments = "x", .about = "e to the x."},
    {.name = "ln",
     .signature = "n:1",
     .value = logarithm,
     .arguments = "x",
     .about = "The natural logarithm."},
    {.name = "log10",
     .signature = "n:1",
     .value = decimal_logarithm,
     .arguments = "x",
     .about = "The decimal logarithm."},
    {.name = "sin", .signature = "1:1", .value = sine, .arguments = "angle", .about = "The sine."},
    {.name = "cos", .signature = "1:1", .value = cosine, .arguments = "angle", .about = "The cosine."},
    {.name = "tan", .signature = "1:1", .value = tangent, .arguments = "angle", .about = "The tangent."},
    {.name = "asin",
     .signature = "1:1",
     .value = arc_sine,
     .arguments = "x",
     .about = "The angle of a sine."},
    {.name = "acos",
     .signature = "1:1",
     .value = arc_cosine,
     .arguments = "x",
     .about = "The angle of a cosine."},
    {.name = "atan",
     .signature = "1:1",
     .value = arc_tangent,
     .arguments = "x",
     .about = "The angle of a tangent."},
    {.name = "atan2",
     .signature = "qq:1",
     .value = angle_of,
     .arguments = "y, x",
     .about = "The angle of the direction (x, y)."},
    {.name = "hypot",
     .signature = "qq:q",
     .needs_absolute_zero = true,
     .value = hypotenuse,
     .arguments = "x, y",
     .about = "The length of (x, y)."},
    {.name = "sign",
     .signature = "r:1",
     .needs_absolute_zero = true,
     .value = sign,
     .arguments = "x",
     .about = "-1, 0 or 1."},
    {.name = "floor",
     .signature = "n:1",
     .value = floor_of,
     .arguments = "x",
     .about = "The largest whole number that is not above x."},
    {.name = "ceil",
     .signature = "n:1",
     .value = ceiling_of,
     .arguments = "x",
     .about = "The smallest whole number that is not below x."},
    {.name = "round",
     .signature = "n:1",
     .value = rounded,
     .arguments = "x",
     .about = "The nearest whole number; halves away from 0."},
    {.name = "mod",
     .signature = "qq:q",
     .needs_absolute_zero = true,
     .value = remainder_of,
     .arguments = "x, y",
     .about = "x less the largest multiple of y that is not above it."},
    {.name = "known",
     .signature = "r:t",
     .reports_known = true,
     .value = is_known,
     .arguments = "x",
     .about = "Whether the value is known: its signals are fresh."},
    {.name = "previous",
     .signature = "q[q]:q",
     .state_size = 2,
     .value = previous,
     .arguments = "x, [initial]",
     .about = "x of the step before; in its first step `initial`, or x."},
    {.name = "delay",
     .signature = "qS[q]:q",
     .state_size = 3,
     .state_per_period = true,
     .value = delayed,
     .arguments = "x, duration, [initial]",
     .about = "x of so long ago; before that `initial`, or its first value."},
    {.name = "lag",
     .signature = "qs[q]:q",
     .state_size = 3,
     .value = lagged,
     .problem = problem_of_time_constant,
     .arguments = "x, time_constant, [initial]",
     .about = "Follows x as a first-order lag, from `initial`, or from its first value."},
    {.name = "rate_limit",
     .signature = "qv[v]:q",
     .state_size = 3,
     .value = rate_limited,
     .problem = problem_of_rate,
     .arguments = "x, rate, [falling_rate]",
     .about = "Follows x at no more than the rate."},
    {.name = "hysteresis",
     .signature = "qqq:t",
     .state_size = 2,
     .value = hysteresis,
     .problem = problem_of_limits<1>,
     .arguments = "x, low, high",
     .about = "True from where x reaches high until it falls to low."},
    {.name = "rise",
     .signature = "t:t",
     .state_size = 2,
     .value = rises,
     .arguments = "condition",
     .about = "True in the step in which the condition becomes true."},
    {.name = "fall",
     .signature = "t:t",
     .state_size = 2,
     .value = falls,
     .arguments = "condition",
     .about = "True in the step in which the condition becomes false."},
    {.name = "changed",
     .signature = "r:t",
     .state_size = 2,
     .value = changes,
     .arguments = "x",
     .about = "True in a step in which x is not what it was in the step before."},
    {.name = "count",
     .signature = "t[t]:1",
     .state_size = 4,
     .may_be_lower_bound = true,
     .value = counted,
     .arguments = "condition, [reset]",
     .about = "How often the condition has become true since the reset."},
    {.name = "latch",
     .signature = "tt:t",
     .state_size = 2,
     .value = latched,
     .arguments = "set, reset",
     .about = "True from where set is true until reset is; reset wins."},
    {.name = "hold",
     .signature = "qt:q",
     .state_size = 2,
     .value = held,
     .arguments = "x, when",
     .about = "x of the last step in which `when` was true, or of its first step."},
    {.name = "duration",
     .signature = "t:s",
     .state_size = 4,
     .may_be_lower_bound = true,
     .value = time_true,
     .arguments = "condition",
     .about = "How long the condition has been true; 0 while it is false."},
    {.name = "integral",
     .signature = "p[t]:P",
     .state_size = 3,
     .value = integral,
     .arguments = "x, [reset]",
     .about = "The sum of x over time since the reset."},
    {.name = "derivative",
     .signature = "q:v",
     .state_size = 4,
     .follows_writes = true,
     .value = derivative,
     .arguments = "x",
     .about = "The change of x from one written value to the next, over the time between them."},
    {.name = "pid",
     .signature = "pid",
     .state_size = 6,
     .value = pid,
     .problem = problem_of_limits<4>,
     .arguments = "error, kp, ki, kd, low, high",
     .about = "A controller's output between low and high, whose integral stops at them."},
    {.name = "uniform",
     .signature = "qq:q",
     .state_size = 1,
     .per_tick = true,
     .value = uniform_noise,
     .problem = problem_of_limits<0>,
     .arguments = "low, high",
     .about = "A new random value in [low, high) in each step, from the run's seed."},
    {.name = "noise",
     .signature = "q:q",
     .state_size = 1,
     .per_tick = true,
     .takes_difference = true,
     .value = normal_noise,
     .problem = problem_of_deviation,
     .arguments = "deviation",
     .about = "A new normally distributed value around 0 in each step, from the run's seed."},
};

}  // namespace

std::span<const Function> functions() {
  return table;
}

}  // namespace hil::expression
