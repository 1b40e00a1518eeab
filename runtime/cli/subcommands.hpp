#pragma once
// The subcommands of hil. Each adds itself to the app; once parsed it runs and sets the exit code
// (run/session.hpp).

#include <CLI/CLI.hpp>

namespace hil::cli {

void add_run(CLI::App& app, int& exit_code);
void add_check(CLI::App& app, int& exit_code);
void add_report(CLI::App& app, int& exit_code);
void add_history(CLI::App& app, int& exit_code);
void add_db(CLI::App& app, int& exit_code);
void add_doctor(CLI::App& app, int& exit_code);
void add_keys(CLI::App& app, int& exit_code);

}  // namespace hil::cli
