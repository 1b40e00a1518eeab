#include "runtime/modules/run_events.hpp"

#include <algorithm>
#include <cstdio>
#include <tuple>

namespace hil::modules {
namespace {

std::string with_number(const std::string& text, double number, int decimals) {
  const std::size_t place = text.find("{}");
  if (place == std::string::npos) return text;
  char digits[64];
  std::snprintf(digits, sizeof digits, "%.*f", decimals, number);
  return text.substr(0, place) + digits + text.substr(place + 2);
}

}  // namespace

RunEvents::RunEvents(std::size_t capacity) : entries_(capacity) {}

RunEvents::Kind RunEvents::add_kind(std::string text, int decimals) {
  kinds_.push_back({std::move(text), decimals});
  return {static_cast<std::uint32_t>(kinds_.size() - 1)};
}

void RunEvents::note(Kind kind, std::int64_t time_ns, double number) noexcept {
  const std::uint64_t place = noted_.fetch_add(1, std::memory_order_relaxed);
  if (place < entries_.size()) entries_[place] = {time_ns, kind.index, number};
}

std::vector<RunEvents::Event> RunEvents::events() const {
  const auto kept = std::min<std::size_t>(noted_.load(), entries_.size());
  std::vector<Entry> sorted(entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(kept));
  std::sort(sorted.begin(), sorted.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.time_ns, a.kind, a.number) < std::tie(b.time_ns, b.kind, b.number);
  });
  std::vector<Event> events;
  events.reserve(sorted.size());
  for (const Entry& entry : sorted) {
    const KindText& kind = kinds_[entry.kind];
    events.push_back({entry.time_ns, with_number(kind.text, entry.number, kind.decimals)});
  }
  return events;
}

std::uint64_t RunEvents::lost() const noexcept {
  const std::uint64_t noted = noted_.load();
  return noted > entries_.size() ? noted - entries_.size() : 0;
}

}  // namespace hil::modules
