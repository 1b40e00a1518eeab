#include "runtime/modules/rigid_bodies/touch_log.hpp"

#include <algorithm>
#include <utility>

namespace hil::modules {

TouchLog::TouchLog(std::vector<std::string> names)
    : names_(std::move(names)),
      kinds_(names_.size() * names_.size()),
      has_touched_(names_.size() * names_.size(), false) {
  touches_.reserve(names_.size() * names_.size() / 2);
}

std::size_t TouchLog::index_of(std::uint32_t first, std::uint32_t second) const noexcept {
  return std::min(first, second) * names_.size() + std::max(first, second);
}

void TouchLog::add_kinds(EventLog& events, const std::vector<bool>& moves) {
  events_ = &events;
  for (std::uint32_t a = 0; a < names_.size(); ++a) {
    for (std::uint32_t b = a + 1; b < names_.size(); ++b) {
      if (!moves[a] && !moves[b]) continue;
      kinds_[index_of(a, b)] = events.add_kind(names_[a] + " touches " + names_[b] + " at {} m/s", 4);
    }
  }
}

void TouchLog::note_first(const Touch& touch) noexcept {
  const std::size_t index = index_of(touch.first, touch.second);
  if (has_touched_[index]) return;
  has_touched_[index] = true;
  touches_.push_back(touch);
  events_->note(kinds_[index], touch.time_ns, touch.closing_speed_mps);
}

contribution::Table TouchLog::table() const {
  const auto number = [](const char* title, const char* unit, int decimals) {
    return contribution::Column{.title = title, .numeric = true, .unit = unit, .decimals = decimals};
  };
  contribution::Table table{.columns = {{.title = "Bodies"},
                                        number("Run time", "s", 4),
                                        number("x", "m", 4),
                                        number("y", "m", 4),
                                        number("z", "m", 4),
                                        number("Closing speed", "m/s", 4),
                                        number("Depth", "mm", 3)},
                            .rows = {}};
  for (const Touch& touch : touches_) {
    table.rows.push_back({{.text = names_[touch.first] + ", " + names_[touch.second]},
                          {.number = static_cast<double>(touch.time_ns) * 1e-9},
                          {.number = touch.place_m.x},
                          {.number = touch.place_m.y},
                          {.number = touch.place_m.z},
                          {.number = touch.closing_speed_mps},
                          {.number = 1e3 * touch.depth_m}});
  }
  return table;
}

}  // namespace hil::modules
