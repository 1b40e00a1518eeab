#include "runtime/signals/signal_scope.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/expression/relation.hpp"

namespace hil::signals {

SignalScope::SignalScope(const config::Expression& expression, const SignalTable& table,
                         const KnownSignals* known)
    : table_(table), known_(known) {
  for (const std::string& name : expression::names_read(expression.nodes())) {
    const auto signal = table.find(name);
    if (signal && std::ranges::find(signals_, *signal) == signals_.end()) signals_.push_back(*signal);
  }
}

std::optional<expression::Variable> SignalScope::find(std::string_view name) const {
  const auto signal = table_.find(name);
  if (!signal) return std::nullopt;
  const SignalInfo& info = table_.info(*signal);
  const auto place = std::ranges::find(signals_, *signal);
  return expression::Variable{.index = static_cast<std::uint32_t>(place - signals_.begin()),
                              .unit = info.unit,
                              .named_values = &info.named_values,
                              .value_kind = info.value_kind,
                              .lacks_unit = info.arrives && info.unit.empty(),
                              .constant = known_ == nullptr ? std::nullopt : known_->constant(*signal)};
}

bool SignalScope::is_broken(std::string_view name) const {
  return known_ != nullptr && known_->is_undeclared(name);
}

void sample(const SignalTable& table, std::span<const SignalId> signals, Unpublished unpublished,
            double time_s, std::span<double> values, std::span<expression::WriteTimes> written) noexcept {
  for (std::size_t i = 0; i < signals.size(); ++i) {
    const bool is_known =
        unpublished == Unpublished::unknown ? table.is_known(signals[i]) : table.is_readable(signals[i]);
    const SignalValue& signal = table.read(signals[i]);
    values[i] = is_known ? signal.value : std::numeric_limits<double>::quiet_NaN();
    written[i] = {.newest_s = time_s, .oldest_s = time_s};
    if (std::isnan(values[i])) continue;
    written[i].newest_s = static_cast<double>(signal.time_ns) / 1e9;
    written[i].oldest_s = static_cast<double>(signal.time_ns - signal.spread_ns) / 1e9;
  }
}

}  // namespace hil::signals
