#include "runtime/signals/signal_table.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace hil::signals {

SignalId SignalTable::add(SignalInfo info) {
  const auto index = static_cast<std::uint32_t>(infos_.size());
  if (!by_name_.emplace(info.name, index).second) {
    std::fprintf(stderr, "hil: misuse: signal '%s' added twice\n", info.name.c_str());
    std::abort();
  }
  SignalValue value;
  value.value = info.initial;
  values_.push_back(value);
  infos_.push_back(std::move(info));
  return SignalId{index};
}

std::optional<SignalId> SignalTable::find(std::string_view name) const {
  const auto found = by_name_.find(std::string(name));
  if (found == by_name_.end()) return std::nullopt;
  return SignalId{found->second};
}

std::vector<ReadObserver*> SignalTable::read_observers(std::span<const SignalId> ids) const {
  std::vector<ReadObserver*> all;
  for (const SignalId id : ids) {
    const auto observers = read_observers_.find(id.index);
    if (observers == read_observers_.end()) continue;
    for (ReadObserver* const observer : observers->second)
      if (std::ranges::find(all, observer) == all.end()) all.push_back(observer);
  }
  return all;
}

SignalTable SignalTable::copy() const {
  SignalTable table = *this;
  table.followers_.clear();
  table.read_observers_.clear();
  return table;
}

std::vector<std::string> SignalTable::names() const {
  std::vector<std::string> names;
  names.reserve(infos_.size());
  for (const SignalInfo& info : infos_)
    names.push_back(info.name);
  return names;
}

}  // namespace hil::signals
