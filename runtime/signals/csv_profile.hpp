#pragma once
// A column of a CSV file over time.
//
// The first row has the names of the columns, one of them "time" or "time_s" (seconds). Times are strictly
// increasing. The form of the file is that of config/csv_reader.hpp.
//
// Threads: read on the one that reads or wires the scenario; at() and value_at() on the base thread, without
// allocation; at() for non-decreasing times.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <hil/diagnostics.hpp>

#include "runtime/config/expression.hpp"

namespace hil::signals {

class CsvProfile {
 public:
  /// An empty `column` is the only one besides the time.
  /// Empty with mistakes at their places in the file: it can not be read, has no such column, a row with an
  /// empty cell or with text in place of a number, times that are not strictly increasing.
  static std::optional<CsvProfile> read(const std::string& path, const config::Place& named_at,
                                        const config::Word& column, bool is_linear,
                                        config::Diagnostics& diagnostics);

  /// Before the first row that of the first, after the last that of the last.
  double at(std::int64_t time_ns) noexcept;
  /// The same at any time, by a search.
  double value_at(std::int64_t time_ns) const noexcept;
  void rewind() noexcept { next_ = 0; }
  std::int64_t begin_ns() const noexcept { return times_ns_.front(); }
  std::int64_t end_ns() const noexcept { return times_ns_.back(); }
  /// Of the time of the first row.
  const config::Place& begin_place() const noexcept { return begin_place_; }

 private:
  /// `next`: the first row after the time.
  double value_before(std::size_t next, std::int64_t time_ns) const noexcept;

  std::vector<std::int64_t> times_ns_;
  std::vector<double> values_;
  config::Place begin_place_;
  bool is_linear_ = true;
  std::size_t next_ = 0;  ///< the first row after the last time
};

}  // namespace hil::signals
