// hil new: skeletons that build and run at once.

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/cli/subcommands.hpp"
#include "runtime/run/verdict.hpp"

namespace hil::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view module_cmake = R"(cmake_minimum_required(VERSION 3.25)
project(@NAME@ LANGUAGES CXX)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
find_package(hil 0.1 REQUIRED)
add_library(@NAME@ MODULE @NAME@.cpp)
target_link_libraries(@NAME@ PRIVATE hil::module)
set_target_properties(@NAME@ PROPERTIES PREFIX "")
)";

constexpr std::string_view module_source =
    R"(// The plug-in @NAME@ with one module type: a first-order lag of its input.

#include <hil/plugin.hpp>

namespace @NAME@ {

using namespace hil;

/// Outputs a value that follows the input with a time constant.
class Lag final : public modules::Module {
 public:
  explicit Lag(const config::Value& parameters) : time_constant_s_(parameters["time_constant"].number()) {
    ports_.inputs = {{.name = "input", .unit = "", .about = "What the output follows"}};
    ports_.outputs = {{.name = "output", .unit = "", .about = "Follows the input"}};
  }

  const modules::Ports& ports() const noexcept override { return ports_; }

  /// Before the first tick: allocates all memory of the module.
  void configure(const modules::Setup& setup) override {
    half_ = setup.events.add_kind("module " + setup.task.instance + " is above one half");
  }

  /// In the tick: no allocation, no lock, no file.
  void step(modules::StepContext& context) override {
    const double share = static_cast<double>(context.period_ns) * 1e-9 / time_constant_s_;
    const double before = value_;
    value_ += (context.inputs[0].value - value_) * (share < 1.0 ? share : 1.0);
    context.outputs[0] = value_;
    if (before <= 0.5 && value_ > 0.5) context.events->note(half_, context.time_ns);
  }

  /// After the last tick: adds to the report.
  void contribute(contribution::Contribution& report) const override {
    contribution::Section& section = report.section("@NAME@");
    section.name = "@NAME@";
    section.text = "The output is " + std::to_string(value_) + " at the end.";
  }

 private:
  const double time_constant_s_;
  modules::Ports ports_;
  modules::EventLog::Kind half_;
  double value_ = 0.0;
};

modules::ModuleType lag_type() {
  using config::Field;
  using config::Quantity;
  using config::Schema;
  return {.name = "@NAME@",
          .about = "A first-order lag.",
          .parameters = Schema::record({
              Field::with_default("time_constant", Schema::quantity(Quantity::duration_s, 1e-3, 1e3), "1 s",
                                  "How fast the output follows the input."),
          }),
          .create = [](const config::Value& parameters, const modules::TaskParameters& /*task*/,
                       config::Diagnostics& /*diagnostics*/) -> std::unique_ptr<modules::AnyModule> {
            return std::make_unique<Lag>(parameters);
          }};
}

}  // namespace @NAME@

HIL_PLUGIN("@NAME@", "0.1.0", @NAME@::lag_type())
)";

constexpr std::string_view module_scenario = R"(# Build the plug-in, then run this:
#   cmake -B build && cmake --build build
#   hil run @NAME@.yaml
scenario: @NAME@
plugins: [build/@NAME@.so]
clock: virtual
duration: 5 s
tasks:
  - module: lag
    type: @NAME@
    rate: 100 Hz
    parameters: {time_constant: 500 ms}
stimuli:
  - name: step
    drives: lag.input
    at: 1 s
    sequence: [{value: 1}]
expectations:
  - {name: it follows, eventually: lag.output > 0.95, by: 4 s}
  - {name: it never overshoots, always: lag.output <= 1}
)";

constexpr std::string_view scenario_text = R"(# hil run @NAME@.yaml
scenario: @NAME@
clock: virtual
duration: 30 s
tasks:
  - module: tank
    type: block
    rate: 100 Hz
    inputs: {pump: control.pump}
    parameters:
      parameters: {area: 0.5 m2, outflow: 2 l/s}
      inputs: {pump: l/s}
      states:
        level: {initial: 0.4 m, derivative: (pump - outflow) / area, min: 0, max: 1 m}
  - module: control
    type: block
    rate: 10 Hz
    inputs: {level: tank.level}
    parameters:
      inputs: {level: m}
      states: {pump: {initial: 0 l/s}}
      state_machines:
        mode:
          states:
            idle: {entry: {pump: 0}, transitions: [{to: filling, when: level < 0.38 m}]}
            filling: {entry: {pump: 4 l/s}, transitions: [{to: idle, when: level > 0.42 m}]}
expectations:
  - {name: the level is held, always: tank.level > 0.3 m and tank.level < 0.5 m}
  - {name: the pump has run, eventually: control.mode == filling}
)";

std::string filled_in(std::string_view text, const std::string& name) {
  constexpr std::string_view place = "@NAME@";
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t next = std::min(text.find(place, at), text.size());
    result.append(text.substr(at, next - at));
    if (next < text.size()) result += name;
    at = next + place.size();
  }
  return result;
}

bool is_name(const std::string& word) {
  const auto is_lower = [](char letter) { return letter >= 'a' && letter <= 'z'; };
  if (word.empty() || !is_lower(word[0])) return false;
  for (const char letter : word)
    if (!is_lower(letter) && !(letter >= '0' && letter <= '9') && letter != '_') return false;
  return true;
}

/// Prints what it made, or why not.
int write_all(const std::vector<std::pair<fs::path, std::string>>& files) {
  std::error_code error;
  for (const auto& [path, text] : files) {
    if (!fs::exists(path, error)) continue;
    std::fprintf(stderr, "hil new: %s is there already\n", path.c_str());
    return run::exit_bad_config;
  }
  for (const auto& [path, text] : files) {
    if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
    errno = 0;
    std::ofstream out(path);
    out << text;
    out.close();
    if (!out) {
      std::fprintf(stderr, "hil new: %s can not be written: %s\n", path.c_str(), std::strerror(errno));
      return run::exit_io_failed;
    }
    std::printf("%s\n", path.c_str());
  }
  return run::exit_passed;
}

int refuse_name(const std::string& name) {
  std::fprintf(
      stderr, "hil new: '%s' is no name: it begins with a small letter; small letters, digits and _ follow\n",
      name.c_str());
  return run::exit_bad_config;
}

}  // namespace

void add_new(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("new", "write the skeleton of a module or of a scenario");
  command->require_subcommand(1);
  auto name = std::make_shared<std::string>();
  CLI::App* module = command->add_subcommand("module", "a plug-in NAME/ with a module and a scenario for it");
  module->add_option("name", *name, "of the folder, the plug-in and the module type")->required();
  module->callback([name, &exit_code] {
    if (!is_name(*name)) {
      exit_code = refuse_name(*name);
      return;
    }
    const fs::path folder = *name;
    exit_code = write_all({{folder / "CMakeLists.txt", filled_in(module_cmake, *name)},
                           {folder / (*name + ".cpp"), filled_in(module_source, *name)},
                           {folder / (*name + ".yaml"), filled_in(module_scenario, *name)}});
  });
  CLI::App* scenario =
      command->add_subcommand("scenario", "a scenario NAME.yaml, a tank with its controller");
  scenario->add_option("name", *name, "of the scenario")->required();
  scenario->callback([name, &exit_code] {
    exit_code =
        is_name(*name) ? write_all({{*name + ".yaml", filled_in(scenario_text, *name)}}) : refuse_name(*name);
  });
}

}  // namespace hil::cli
