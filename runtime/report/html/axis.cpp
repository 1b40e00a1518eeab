#include "runtime/report/html/axis.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hil::report {
namespace {

constexpr std::array mantissas{1.0, 2.0, 5.0};
constexpr double slightly = 1e-9;

double power_of_ten_below(double value) {
  return std::pow(10.0, std::floor(std::log10(value) + slightly));
}

double rounded_down(double value) {
  const double power = power_of_ten_below(value);
  double best = power;
  for (const double mantissa : mantissas) {
    if (mantissa * power <= value * (1.0 + slightly)) best = mantissa * power;
  }
  return best;
}

double rounded_up(double value) {
  const double power = power_of_ten_below(value);
  for (const double mantissa : mantissas) {
    if (mantissa * power >= value * (1.0 - slightly)) return mantissa * power;
  }
  return 10.0 * power;
}

}  // namespace

double linear_step(double length, int max_count) {
  return rounded_up(length / std::max(max_count - 1, 1));
}

int decimals_of_step(double step) {
  return std::max(0, static_cast<int>(-std::floor(std::log10(step) + slightly)));
}

std::vector<double> linear_ticks(Interval range, int max_count) {
  const double length = range.high - range.low;
  if (!(length > 0.0) || !std::isfinite(length)) return {};
  const double step = linear_step(length, max_count);
  std::vector<double> ticks;
  const double first = std::ceil(range.low / step - slightly);
  const double last = std::floor(range.high / step + slightly);
  const int count =
      std::max(static_cast<int>(last - first) + 1, 0);  // small: the step is a good part of the length
  ticks.reserve(static_cast<std::size_t>(count));
  for (int index = 0; index < count; ++index)
    ticks.push_back((first + index) * step);
  return ticks;
}

std::vector<double> logarithmic_ticks(Interval range) {
  const bool dense = std::log10(range.high / range.low) <= 3.0 + slightly;
  std::vector<double> ticks;
  const double first_power = power_of_ten_below(range.low);
  const int decades = static_cast<int>(std::ceil(std::log10(range.high / first_power)));
  for (int decade = 0; decade <= decades; ++decade) {
    for (const double mantissa : mantissas) {
      if (mantissa > 1.0 && !dense) break;
      const double tick = mantissa * first_power * std::pow(10.0, decade);
      if (tick >= range.low * (1.0 - slightly) && tick <= range.high * (1.0 + slightly))
        ticks.push_back(tick);
    }
  }
  return ticks;
}

Interval rounded_decades(Interval range) {
  Interval wide{rounded_down(range.low), rounded_up(range.high)};
  if (wide.high < 10.0 * wide.low) {
    const double middle = std::sqrt(range.low * range.high);
    wide = {rounded_down(middle / 3.2), rounded_up(middle * 3.2)};
  }
  return wide;
}

Scale::Scale(Kind kind, Interval values, Interval pixels) : kind_(kind), values_(values), pixels_(pixels) {}

double Scale::position(double value) const {
  return kind_ == Kind::logarithmic ? std::log(value) : value;
}

double Scale::operator()(double value) const {
  const double held = std::clamp(value, values_.low, values_.high);
  const double share =
      (position(held) - position(values_.low)) / (position(values_.high) - position(values_.low));
  return pixels_.low + share * (pixels_.high - pixels_.low);
}

}  // namespace hil::report
