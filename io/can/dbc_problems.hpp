#pragma once
// Collects the problems that parsing a DBC text finds.

#include <cstddef>
#include <string>
#include <vector>

#include "io/can/dbc.hpp"
#include "io/can/dbc_scanner.hpp"

namespace hil::io::can {

class DbcProblems {
 public:
  using Severity = DbcProblem::Severity;

  /// Counts a problem, and keeps it if there are fewer than DbcResult::kept_problems or it is fatal.
  /// `position` is a byte offset in the text.
  void report(Severity severity, std::size_t position, std::string text);
  /// Marks a message as unusable for this reason and reports that, unless it has the same reason already.
  void make_unusable(DbcMessage& message, std::size_t position, const std::string& reason);
  /// Moves the problems with their lines and columns, and the counts, into `result`.
  void write_into(DbcResult& result, LineCounter& lines);

 private:
  DbcResult found_;                     ///< problems and counts; the database stays empty
  std::vector<std::size_t> positions_;  ///< one per problem
};

}  // namespace hil::io::can
