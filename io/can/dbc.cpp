#include "io/can/dbc.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "io/can/dbc_parser.hpp"

namespace hil::io::can {

namespace {

template <class Named>
const Named* find_named(const std::vector<Named>& all, std::string_view name) noexcept {
  for (const auto member : {&Named::name, &Named::short_name}) {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Named& one) { return one.*member == name; });
    if (found != all.end()) return &*found;
  }
  return nullptr;
}

}  // namespace

const DbcSignal* DbcMessage::find_signal(std::string_view signal_name) const noexcept {
  return find_named(signals, signal_name);
}

const DbcMessage* Dbc::find_message(std::string_view message_name) const noexcept {
  return find_named(messages, message_name);
}

DbcResult parse_dbc(std::string_view text) {
  return DbcParser(text.data() == nullptr ? "" : text).parse();
}

DbcResult load_dbc(const std::filesystem::path& file) {
  DbcResult result;
  const auto refuse = [&](const std::string& reason) {
    result.problems.push_back({DbcProblem::Severity::fatal, 0, 0, "the file can not be read: " + reason});
    result.error_count = 1;
    result.fatal_count = 1;
    return result;
  };
  std::error_code fault;
  if (std::filesystem::is_directory(file, fault)) return refuse("it is a directory");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return refuse(std::strerror(errno));
  std::string text;
  std::array<char, 65536> part{};
  while (stream.read(part.data(), part.size()), stream.gcount() > 0) {
    text.append(part.data(), static_cast<std::size_t>(stream.gcount()));
    if (text.size() > max_dbc_bytes) return refuse("it has more than 64 MiB");
  }
  if (stream.bad()) return refuse(std::strerror(errno));
  return parse_dbc(text);
}

std::string describe_problems(const DbcResult& result, std::string_view file_name) {
  std::string text;
  for (const DbcProblem& problem : result.problems) {
    text.append(file_name).append(":").append(std::to_string(problem.line)).append(":");
    text.append(std::to_string(problem.column));
    text.append(problem.severity <= DbcProblem::Severity::warning ? ": warning: " : ": error: ");
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
