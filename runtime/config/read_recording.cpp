#include <cmath>
#include <string_view>

#include "runtime/config/section_readers.hpp"

namespace hil::config {

void read_recording(const Value& root, Scenario& scenario, ReaderContext& reading) {
  const Value* const section = part_of(root, "recording");
  if (section == nullptr) return;
  Recording recording;
  if (const Value* const list = part_of(*section, "signals")) {
    constexpr std::string_view permitted =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.*";
    for (const Value& pattern : list->items()) {
      const bool is_relation = pattern.text().ends_with(')');  // if it is one: selected_signals checks it
      if (is_relation || pattern.text().find_first_not_of(permitted) == std::string::npos) {
        recording.signals.push_back(word_of(pattern));
      } else {
        reading.diagnostics.add(
            pattern.place(),
            in_quotes(pattern.text()) + " is neither the name of a signal nor a pattern like plant.*");
      }
    }
  }
  if (!is_whole(*section) || !(*section)["enabled"].boolean()) return;
  recording.frames = (*section)["frames"].boolean();
  recording.max_bytes = static_cast<std::uint64_t>(std::llround((*section)["max_size"].number()));
  scenario.recording = std::move(recording);
}

}  // namespace hil::config
