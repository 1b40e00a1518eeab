#include "runtime/injection/faulty_signal.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "runtime/units/unit.hpp"

namespace hil::injection {
namespace {

using FaultKind = config::FaultSection::Kind;

constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

}  // namespace

FaultValueUnit fault_value_unit(FaultKind kind, const std::string& unit_of_signal) {
  if (kind == FaultKind::gain) return {};
  if (kind == FaultKind::stuck) return {unit_of_signal};
  const units::DifferenceUnit difference = units::difference_unit(unit_of_signal);
  if (kind != FaultKind::drift) return {difference.symbol, difference.factor};
  return {difference.symbol.empty() ? "1/s" : difference.symbol + "/s", difference.factor};
}

SignalEffect::SignalEffect(const config::FaultSection& section, std::int64_t base_period_ns,
                           std::uint64_t seed)
    : section_(section), random_(seed) {
  if (section.kind == FaultKind::delay)
    line_.emplace(static_cast<std::size_t>(section.duration_ns / base_period_ns) + 2);
}

void SignalEffect::begin_tick(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
  if (value_) number_ = value_->evaluate(table, time_ns) * value_factor_;
  // Drawn in each tick, so that one fault's numbers do not depend on when it is active.
  if (section_.kind == FaultKind::noise) number_ *= random_.normal();
  if (section_.kind == FaultKind::dropout) is_dropped_ = random_.uniform() < section_.share;
}

void SignalEffect::begin(std::int64_t time_ns) noexcept {
  is_active_ = true;
  takes_last_ = true;
  began_ns_ = time_ns;
}

bool SignalEffect::replaces_value() const noexcept {
  return is_active_ &&
         (section_.kind == FaultKind::stuck || (section_.kind == FaultKind::dropout && is_dropped_));
}

void SignalEffect::act_on(signals::SignalValue& signal, std::int64_t time_ns) noexcept {
  changes_ = false;
  if (!is_active_) return;
  const signals::SignalValue before = signal;
  switch (section_.kind) {
    case FaultKind::stuck_at_last:
      if (std::exchange(takes_last_, false)) last_ = signal;
      signal = {last_.value, signal.time_ns, true};
      break;
    case FaultKind::stuck:
      signal = {number_, signal.time_ns, true};
      break;
    case FaultKind::offset:
    case FaultKind::noise:
      signal.value += number_;
      break;
    case FaultKind::gain:
      signal.value *= number_;
      break;
    case FaultKind::drift:
      signal.value += number_ * 1e-9 * static_cast<double>(time_ns - began_ns_);
      break;
    case FaultKind::delay:
      signal = line_->at(time_ns - section_.duration_ns, signal);
      break;
    case FaultKind::dropout:
      if (is_dropped_) signal = {no_value, signal.time_ns, false};
      break;
    default:  // no fault of a signal
      break;
  }
  const bool is_same_value =
      signal.value == before.value || (std::isnan(signal.value) && std::isnan(before.value));
  changes_ = !is_same_value || signal.fresh != before.fresh;
}

void FaultySignal::act_on(signals::SignalValue& value, std::size_t number) noexcept {
  effects[number]->act_on(value, time_ns_);
  if (!effects[number]->replaces_value()) return;
  for (std::size_t earlier = 0; earlier < number; ++earlier)
    effects[earlier]->set_replaced();
}

signals::SignalValue FaultySignal::value_with_faults() noexcept {
  signals::SignalValue value = table_->read(signal);
  for (std::size_t i = 0; i < effects.size(); ++i)
    act_on(value, i);
  return value;
}

void FaultySignal::follow(signals::SignalId /*signal*/) noexcept {
  table_->write(faulted, value_with_faults());
}

void FaultySignal::end_tick() noexcept {
  signals::SignalValue value = table_->read(signal);
  for (std::size_t i = 0; i < effects.size(); ++i) {
    effects[i]->keep(value, time_ns_);
    act_on(value, i);
  }
}

void FaultySignal::note_read(signals::ReadBy by) noexcept {
  bool is_replaced = false;
  for (SignalEffect* effect : effects) {
    effect->note_read();
    is_replaced |= effect->replaces_value() || effect->is_stuck_at_last();
  }
  if (is_replaced) return;
  for (signals::ReadObserver* observer : true_signal_observers_)
    observer->note_read(by);
}

}  // namespace hil::injection
