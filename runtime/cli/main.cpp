// hil: the command line. Each subcommand has a file of its own; this file lists them.

#include <CLI/CLI.hpp>

#include <cstdio>
#include <new>
#include <string>

#include "runtime/cli/subcommands.hpp"
#include "runtime/cli/usage_error.hpp"
#include "runtime/run/session.hpp"

namespace {

int command_line(int argc, char** argv) {
  CLI::App app("hil: a hardware-in-the-loop real-time runtime");
  app.set_version_flag("--version", HIL_VERSION);
  app.require_subcommand(1);
  int exit_code = hil::run::exit_internal;
  hil::cli::add_run(app, exit_code);
  hil::cli::add_check(app, exit_code);
  hil::cli::add_report(app, exit_code);
  hil::cli::add_history(app, exit_code);
  hil::cli::add_db(app, exit_code);
  hil::cli::add_doctor(app, exit_code);
  hil::cli::add_keys(app, exit_code);
  hil::cli::add_new(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    const std::string mistake = hil::cli::usage_error(app, error);
    std::fprintf(stderr, "%s\n", mistake.c_str());
    return hil::cli::refuse_arguments(app, mistake);
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return command_line(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fputs("hil: memory ran out; raise its limit (ulimit -v, ulimit -d) or make memory free\n", stderr);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hil: internal fault: %s\n", error.what());
  }
  return hil::run::exit_internal;
}
