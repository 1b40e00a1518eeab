#include "io/can/dbc_problems.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace hil::io::can {

void DbcProblems::report(Severity severity, std::size_t position, std::string text) {
  ++(severity <= Severity::warning ? found_.warning_count : found_.error_count);
  if (severity == Severity::fatal) ++found_.fatal_count;
  if (severity != Severity::fatal && found_.problems.size() >= DbcResult::kept_problems) return;
  if (found_.problems.size() >= DbcResult::kept_problems) {
    found_.problems.pop_back();  // a fatal problem is always listed
    positions_.pop_back();
  }
  found_.problems.push_back({severity, 0, 0, std::move(text)});
  positions_.push_back(position);
}

void DbcProblems::make_unusable(DbcMessage& message, std::size_t position, const std::string& reason) {
  if (std::find(message.unusable.begin(), message.unusable.end(), reason) != message.unusable.end()) return;
  message.unusable.push_back(reason);
  report(Severity::unusable, position, "message '" + message.name + "' can not be used: " + reason);
}

void DbcProblems::write_into(DbcResult& result, LineCounter& lines) {
  std::vector<std::size_t> order(positions_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return positions_[a] < positions_[b]; });
  for (const std::size_t index : order) {  // ascending, for which LineCounter is fast
    const LineCounter::Place place = lines.place_of(positions_[index]);
    found_.problems[index].line = place.line;
    found_.problems[index].column = place.column;
  }
  result.problems = std::move(found_.problems);
  result.error_count = found_.error_count;
  result.fatal_count = found_.fatal_count;
  result.warning_count = found_.warning_count;
}

}  // namespace hil::io::can
