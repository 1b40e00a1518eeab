#include "runtime/signals/csv_profile.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "runtime/config/csv_reader.hpp"

namespace hil::signals {
namespace {

using config::Place;

/// The index of the only column besides the time; empty with a mistake.
std::optional<std::size_t> only_value(std::size_t columns, std::optional<std::size_t> time,
                                      const Place& place, config::Diagnostics& diagnostics) {
  if (!time) return std::nullopt;
  if (columns == 2) return 1 - *time;
  diagnostics.add(place, columns < 2 ? std::string("the file has no column of values")
                                     : "the file has " + std::to_string(columns - 1) +
                                           " columns of values; 'column' has to name one");
  return std::nullopt;
}

bool has_column(const config::CsvReader& file, std::string_view name) {
  for (std::size_t i = 0; i < file.columns(); ++i)
    if (file.cell(i) == name) return true;
  return false;
}

}  // namespace

std::optional<CsvProfile> CsvProfile::read(const std::string& path, const Place& named_at,
                                           const config::Word& column, bool is_linear,
                                           config::Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.count();
  config::CsvReader file(path, named_at, diagnostics);
  CsvProfile profile;
  profile.is_linear_ = is_linear;
  if (file.next()) {
    const auto time = file.find_column(has_column(file, "time_s") ? "time_s" : "time", file.place(0));
    const auto value = column.text.empty() ? only_value(file.columns(), time, column.place, diagnostics)
                                           : file.find_column(column.text, column.place);
    if (!time || !value) return std::nullopt;
    while (file.next()) {
      const auto time_s = file.number(*time);
      const auto number = time_s ? file.number(*value) : std::nullopt;
      if (!number) return std::nullopt;
      if (std::abs(*time_s) > 1e9) {
        file.refuse(*time, "a time beyond 1e9 s");
        return std::nullopt;
      }
      const auto time_ns = static_cast<std::int64_t>(std::llround(1e9 * *time_s));
      if (!profile.times_ns_.empty() && time_ns <= profile.times_ns_.back()) {
        file.refuse(*time,
                    "times have to be strictly increasing, but this one is not after that of the row before");
        return std::nullopt;
      }
      if (profile.times_ns_.empty()) profile.begin_place_ = file.place(*time);
      profile.times_ns_.push_back(time_ns);
      profile.values_.push_back(*number);
    }
  }
  if (diagnostics.count() == before && profile.times_ns_.empty())
    diagnostics.add(named_at, "the file has no rows");
  if (diagnostics.count() != before) return std::nullopt;
  return profile;
}

double CsvProfile::at(std::int64_t time_ns) noexcept {
  while (next_ < times_ns_.size() && times_ns_[next_] <= time_ns)
    ++next_;
  return value_before(next_, time_ns);
}

double CsvProfile::value_at(std::int64_t time_ns) const noexcept {
  const auto next = std::ranges::upper_bound(times_ns_, time_ns);
  return value_before(static_cast<std::size_t>(next - times_ns_.begin()), time_ns);
}

double CsvProfile::value_before(std::size_t next, std::int64_t time_ns) const noexcept {
  if (next == 0) return values_.front();
  if (next == times_ns_.size() || !is_linear_) return values_[next - 1];
  const double share = static_cast<double>(time_ns - times_ns_[next - 1]) /
                       static_cast<double>(times_ns_[next] - times_ns_[next - 1]);
  return values_[next - 1] + share * (values_[next] - values_[next - 1]);
}

}  // namespace hil::signals
