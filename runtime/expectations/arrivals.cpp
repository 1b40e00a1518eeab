#include "runtime/expectations/arrivals.hpp"

#include <algorithm>

#include "runtime/expectations/time_text.hpp"

namespace hil::expectations {

Arrivals::Source& Arrivals::source_of(io::Device& device, const signals::Links& links) {
  io::ArrivalSource* const arrivals = device.arrival_source();
  const auto found = std::ranges::find(sources_, arrivals, &Source::arrivals);
  if (found != sources_.end()) return *found;
  Source source{.arrivals = arrivals,
                .inputs = links.inputs,
                .fresh = std::vector<signals::SignalId>(links.inputs.size()),
                .values = std::vector<io::InputValue>(links.inputs.size()),
                .next = std::nullopt};
  const auto groups = device.input_groups();
  for (std::size_t i = 0; i < std::min(groups.size(), links.fresh.size()); ++i)
    std::fill_n(source.fresh.begin() + static_cast<std::ptrdiff_t>(groups[i].first), groups[i].count,
                links.fresh[i]);
  collected_.reserve(max_arrivals);
  values_.reserve(max_values);
  return sources_.emplace_back(std::move(source));
}

void Arrivals::keep(io::Device& device, const signals::Links& links, signals::SignalId signal) {
  const auto input = std::ranges::find(links.inputs, signal);
  if (keeps(signal) || input == links.inputs.end()) return;
  const auto index = static_cast<std::size_t>(input - links.inputs.begin());
  io::ArrivalSource* const arrivals = device.arrival_source();
  if (arrivals == nullptr || !arrivals->keep_arrivals(index)) return;
  const Source& source = source_of(device, links);
  kept_.push_back(signal);
  for (const io::InputGroup& group : device.input_groups()) {
    if (index < group.first || index >= group.first + group.count) continue;
    for (std::size_t i = group.first; i < group.first + group.count; ++i)
      if (!keeps(links.inputs[i])) kept_.push_back(links.inputs[i]);
    if (source.fresh[index].valid()) kept_.push_back(source.fresh[index]);
  }
}

bool Arrivals::keeps(signals::SignalId signal) const noexcept {
  return std::ranges::find(kept_, signal) != kept_.end();
}

void Arrivals::take_next(Source& source) noexcept {
  do
    source.next = source.arrivals->next_arrival(source.values);
  while (source.next && source.next->time_ns < 0);
}

std::span<const Arrival> Arrivals::collect() noexcept {
  collected_.clear();
  values_.clear();
  for (Source& source : sources_)
    if (!source.next) take_next(source);
  while (collected_.size() < max_arrivals) {
    Source* earliest = nullptr;
    for (Source& source : sources_)
      if (source.next && (earliest == nullptr || source.next->time_ns < earliest->next->time_ns))
        earliest = &source;
    if (earliest == nullptr || values_.size() + 2 * earliest->next->count > max_values) break;
    add(*earliest);
    take_next(*earliest);
  }
  return collected_;
}

void Arrivals::add(const Source& source) noexcept {
  const std::size_t first = values_.size();
  signals::SignalId fresh;
  for (const io::InputValue& arrived : std::span(source.values).first(source.next->count)) {
    values_.push_back({source.inputs[arrived.input], arrived.value});
    if (source.fresh[arrived.input] == fresh) continue;
    fresh = source.fresh[arrived.input];
    if (fresh.valid()) values_.push_back({fresh, 1.0});
  }
  collected_.push_back({source.next->time_ns, std::span(values_).subspan(first)});
}

std::uint64_t Arrivals::lost() const noexcept {
  return lost_by_devices() - lost_before_;
}

std::string Arrivals::lost_text() const {
  if (lost() == 0) return "";
  return counted(lost(), "frame was", "frames were") + " lost between the bus and the tick";
}

std::uint64_t Arrivals::lost_by_devices() const noexcept {
  std::uint64_t lost = 0;
  for (const Source& source : sources_)
    lost += source.arrivals->lost_arrivals();
  return lost;
}

}  // namespace hil::expectations
