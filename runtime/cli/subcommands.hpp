#pragma once
// The subcommands of hil. Each function adds one to the app. When the command line names it, CLI11 runs it
// and it sets the exit code (run/verdict.hpp).

#include <CLI/CLI.hpp>

#include <string>

namespace hil::cli {

void add_run(CLI::App& app, int& exit_code);
/// The exit code for a command line that can not be parsed. When it names `run` and a folder for it, the
/// folder gets a junit.xml with the mistake.
int refuse_arguments(const CLI::App& app, const std::string& mistake);
void add_check(CLI::App& app, int& exit_code);
void add_report(CLI::App& app, int& exit_code);
void add_history(CLI::App& app, int& exit_code);
void add_db(CLI::App& app, int& exit_code);
void add_doctor(CLI::App& app, int& exit_code);
void add_keys(CLI::App& app, int& exit_code);
void add_new(CLI::App& app, int& exit_code);

}  // namespace hil::cli
