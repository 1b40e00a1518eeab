#include "runtime/run/program_check.hpp"

#include <unistd.h>

#include <string>
#include <vector>

#include "io/virtual/process.hpp"

namespace hil::run {
namespace {

/// Why the file can not be run, as a clause; empty: it can.
std::string problem_of(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return "does not exist";
  if (std::filesystem::is_directory(file, error)) return "is a folder";
  return ::access(file.c_str(), X_OK) == 0 ? "" : "is not executable";
}

}  // namespace

void check_programs(const config::Scenario& scenario, std::span<const std::filesystem::path> search_folders,
                    config::Diagnostics& diagnostics) {
  const std::filesystem::path folder = std::filesystem::path(scenario.file).parent_path();
  const std::vector<std::filesystem::path> folders(search_folders.begin(), search_folders.end());
  for (const config::ProcessSection& process : scenario.processes) {
    if (!process.enabled) continue;
    const config::CommandWord& word = process.command.front();
    const std::string& program = word.written.text;
    if (!word.placeholders.empty()) continue;
    const std::string subject =
        "the program " + config::in_quotes(program) + " of process " + config::in_quotes(process.name.text);
    if (program.find('/') == std::string::npos) {
      if (io::process::find_program(program, folders).empty())
        diagnostics.warn(word.written.place,
                         subject + " is neither beside hil nor in PATH; write its path, or install it");
      continue;
    }
    const std::string problem = problem_of(folder / program);
    if (problem.empty()) continue;
    const bool is_absolute = std::filesystem::path(program).is_absolute();
    diagnostics.add(
        word.written.place,
        subject + " " + problem + (is_absolute ? "" : "; a path begins at the folder of the scenario"));
  }
}

}  // namespace hil::run
