#include "runtime/cli/history_options.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <rtstdb/limits.hpp>

#include "runtime/history/history_error.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::cli {

void refuse(const std::string& sentence) {
  throw history::HistoryError(history::HistoryError::Kind::question, sentence);
}

config::QuantityReading read_option(const char* option, const std::string& text, config::Quantity quantity) {
  config::QuantityReading reading = config::read_quantity(text, quantity);
  if (!reading.fault.empty()) refuse(std::string(option) + " " + text + ": " + reading.fault);
  return reading;
}

std::int64_t read_time_ns(const char* option, const std::string& text) {
  return read_option(option, text, config::Quantity::duration_s).nanoseconds;
}

double read_distance_m(const char* option, const std::string& text) {
  const double value_m = read_option(option, text, config::Quantity::length_m).value_si;
  if (value_m < 0.0) refuse(std::string(option) + " " + text + " is negative");
  if (value_m > rtstdb::max_coordinate_m)
    refuse(std::string(option) + " " + text + ": no world is larger than " +
           report::shortest(rtstdb::max_coordinate_m) + " m to each side");
  return value_m;
}

void check_outside(const char* option, const std::string& file, const std::string& directory) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path target = fs::weakly_canonical(file, error), run = fs::canonical(directory, error);
  const auto [end, ignored] = std::mismatch(run.begin(), run.end(), target.begin(), target.end());
  if (!error && end == run.end())
    refuse(std::string(option) + " " + file +
           " is in the folder of the run, in which a history changes nothing");
}

void check_numbers(const char* option, const std::vector<double>& numbers) {
  for (const double number : numbers)
    if (!std::isfinite(number)) refuse(std::string(option) + ": not every number is finite");
}

void check_sizes(const char* option, const std::vector<double>& numbers, std::size_t first) {
  for (std::size_t k = first; k < numbers.size(); ++k)
    if (numbers[k] < 0.0)
      refuse(std::string(option) + ": a size of " + std::to_string(numbers[k]) + " m is negative");
}

glm::vec3 three_of(const std::vector<double>& numbers, std::size_t first) {
  return {static_cast<float>(numbers[first]), static_cast<float>(numbers[first + 1]),
          static_cast<float>(numbers[first + 2])};
}

}  // namespace hil::cli
