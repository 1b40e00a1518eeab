#include "runtime/signals/signal_table.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <utility>

namespace hil::signals {
namespace {

/// Levenshtein distance, in one row.
std::size_t edit_distance(std::string_view left, std::string_view right) {
  std::vector<std::size_t> row(right.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < left.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < right.size(); ++j) {
      const std::size_t replaced = diagonal + (left[i] == right[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

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

std::string SignalTable::nearest_name(std::string_view name) const {
  const SignalInfo* nearest = nullptr;
  // "Near" means that at most a third of the letters differ; a farther name would mislead.
  std::size_t smallest = std::max<std::size_t>(name.size() / 3, 1) + 1;
  for (const SignalInfo& info : infos_) {
    const std::size_t distance = edit_distance(name, info.name);
    if (distance < smallest) {
      smallest = distance;
      nearest = &info;
    }
  }
  return nearest == nullptr ? std::string() : nearest->name;
}

}  // namespace hil::signals
