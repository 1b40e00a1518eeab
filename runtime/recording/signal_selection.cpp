#include "runtime/recording/signal_selection.hpp"

#include <string>

namespace hil::recording {

bool matches(std::string_view pattern, std::string_view name) noexcept {
  // The last `*` takes one character more each time that the rest does not agree.
  std::size_t p = 0, n = 0, star = std::string_view::npos, taken = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      taken = n;
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++p, ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++taken;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

std::vector<signals::SignalId> selected_signals(const config::Recording& section,
                                                const signals::KnownSignals& known,
                                                config::Diagnostics& diagnostics) {
  const signals::SignalTable& table = known.table();
  std::vector<char> is_selected(table.size());
  for (const config::Word& word : section.signals) {
    if (word.text.find('*') == std::string::npos) {
      const signals::SignalId signal = known.find(word, diagnostics);
      is_selected.resize(table.size());  // it may be a new relation
      if (signal.valid()) is_selected[signal.index] = 1;
      continue;
    }
    bool is_found = word.text == "*" || known.is_undeclared(word.text);
    for (std::uint32_t i = 0; i < table.size(); ++i) {
      if (!matches(word.text, table.info({i}).name)) continue;
      is_selected[i] = 1;
      is_found = true;
    }
    if (!is_found) diagnostics.add(word.place, "no signal has a name like '" + word.text + "'");
  }
  std::vector<signals::SignalId> selected;
  for (std::uint32_t i = 0; i < table.size(); ++i)
    if (is_selected[i] != 0) selected.push_back({i});
  return selected;
}

}  // namespace hil::recording
