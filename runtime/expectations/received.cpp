#include "runtime/expectations/received.hpp"

#include <algorithm>
#include <limits>

namespace hil::expectations {

bool Received::is_fresh(const signals::SignalTable& table) const noexcept {
  return fresh ? table.value(*fresh) != 0.0 : table.read(signals.front()).fresh;
}

std::int64_t Received::newest_ns(const signals::SignalTable& table) const noexcept {
  std::int64_t newest = std::numeric_limits<std::int64_t>::min();
  for (const signals::SignalId signal : signals)
    newest = std::max(newest, table.read(signal).time_ns);
  return newest;
}

std::optional<Received> find_received(const std::string& name, const signals::SignalTable& table) {
  Received received;
  if (const auto state = table.find(name + ".fresh"); state && !table.info(*state).arrives) {
    received.fresh = state;
    for (const std::string& signal : table.names()) {
      const signals::SignalId id = *table.find(signal);
      if (table.info(id).arrives && (signal == name || signal.starts_with(name + ".")))
        received.signals.push_back(id);
    }
  } else if (const auto id = table.find(name); id && table.info(*id).arrives) {
    received.signals.push_back(*id);
  }
  if (received.signals.empty()) return std::nullopt;
  received.timeout_ns = table.info(received.signals.front()).timeout_ns;
  return received;
}

void check_received(const config::Word& name, bool is_message, const ClaimCheck& check) {
  const signals::SignalTable& table = check.known.table();
  const auto received = find_received(name.text, table);
  if ((received && (received->fresh || !is_message)) || check.known.is_undeclared(name.text)) return;
  if (table.find(name.text)) {
    check.diagnostics.add(name.place, "'" + name.text +
                                          (received ? "' is a signal; name its message"
                                                    : "' does not arrive from a bus or a unit"));
    return;
  }
  std::vector<std::string> known;
  for (const std::string& signal : table.names()) {
    const bool arrives = table.info(*table.find(signal)).arrives;
    if (signal.ends_with(".fresh") && !arrives) known.push_back(signal.substr(0, signal.size() - 6));
    if (arrives && !is_message) known.push_back(signal);
  }
  check.diagnostics.add(name.place, std::string("there is no received message ") +
                                        (is_message ? "" : "or signal ") + config::in_quotes(name.text) +
                                        config::suggestion(name.text, known));
}

}  // namespace hil::expectations
