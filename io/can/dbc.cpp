#include "io/can/dbc.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "io/can/dbc_parser.hpp"

namespace hil::io::can {

const DbcSignal* DbcMessage::find_signal(std::string_view signal_name) const noexcept {
  const auto found = std::find_if(signals.begin(), signals.end(),
                                  [&](const DbcSignal& signal) { return signal.name == signal_name; });
  return found == signals.end() ? nullptr : &*found;
}

const DbcMessage* Dbc::find_message(std::string_view message_name) const noexcept {
  const auto found = std::find_if(messages.begin(), messages.end(),
                                  [&](const DbcMessage& message) { return message.name == message_name; });
  return found == messages.end() ? nullptr : &*found;
}

DbcResult parse_dbc(std::string_view text) {
  return DbcParser(text.data() == nullptr ? "" : text).parse();
}

DbcResult load_dbc(const std::filesystem::path& file) {
  DbcResult result;
  const auto refuse = [&](const std::string& reason) {
    result.problems.push_back({DbcProblem::Severity::error, 0, 0, "the file can not be read: " + reason});
    result.error_count = 1;
    return result;
  };
  std::error_code fault;
  if (std::filesystem::is_directory(file, fault)) return refuse("it is a directory");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return refuse(std::strerror(errno));
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (stream.bad()) return refuse(std::strerror(errno));
  return parse_dbc(text);
}

std::string describe_problems(const DbcResult& result, std::string_view file_name) {
  std::string text;
  for (const DbcProblem& problem : result.problems) {
    text.append(file_name).append(":").append(std::to_string(problem.line)).append(":");
    text.append(std::to_string(problem.column));
    text.append(problem.severity == DbcProblem::Severity::error ? ": error: " : ": warning: ");
    text.append(problem.text).append("\n");
  }
  const std::size_t all = result.error_count + result.warning_count;
  if (all > result.problems.size()) {
    text.append(file_name)
        .append(": and ")
        .append(std::to_string(all - result.problems.size()))
        .append(" more\n");
  }
  return text;
}

}  // namespace hil::io::can
