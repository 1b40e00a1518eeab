#include "bench/figure/figure.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <thread>

namespace hil::bench {
namespace {

std::string rounded(double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.3f", value);
  return text.data();
}

}  // namespace

std::optional<double> Figure::ratio() const {
  if (!theirs) return std::nullopt;
  const double over = better == Better::lower ? *theirs : ours;
  const double under = better == Better::lower ? ours : *theirs;
  if (under == 0.0) return std::nullopt;
  return over / under;
}

std::string device_name() {
  std::ifstream cpus("/proc/cpuinfo");
  std::string model = "unknown CPU";
  for (std::string line; std::getline(cpus, line);) {
    if (!line.starts_with("model name")) continue;
    model = line.substr(line.find(':') + 2);
    break;
  }
  return model + " x " + std::to_string(std::thread::hardware_concurrency());
}

std::string as_json_line(const Figure& figure, const std::string& device) {
  nlohmann::ordered_json line;
  line["name"] = figure.name;
  line["ours"] = figure.ours;
  line["unit"] = figure.unit;
  line["peer"] = figure.peer.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(figure.peer);
  line["theirs"] = figure.theirs ? nlohmann::ordered_json(*figure.theirs) : nlohmann::ordered_json();
  const std::optional<double> ratio = figure.ratio();
  line["ratio"] = ratio ? nlohmann::ordered_json(*ratio) : nlohmann::ordered_json();
  line["better"] = figure.better == Better::higher ? "higher" : "lower";
  line["device"] = device;
  line["samples"] = figure.samples;
  return line.dump();
}

std::string as_text_line(const Figure& figure) {
  std::string line = figure.name;
  line += ": " + rounded(figure.ours) + ' ' + figure.unit;
  if (figure.theirs) line += ", " + figure.peer + ' ' + rounded(*figure.theirs) + ' ' + figure.unit;
  if (const std::optional<double> ratio = figure.ratio()) line += ", ratio " + rounded(*ratio);
  return line;
}

namespace {

void demand_some(const std::vector<double>& values, const char* what) {
  if (!values.empty()) return;
  std::fprintf(stderr, "hil: misuse: %s of no values\n", what);
  std::abort();
}

}  // namespace

double quantile(std::vector<double> values, double share) {
  demand_some(values, "quantile");
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

double median(std::vector<double> values) {
  demand_some(values, "median");
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2.0;
}

}  // namespace hil::bench
