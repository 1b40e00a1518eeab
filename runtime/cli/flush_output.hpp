#pragma once
// A subcommand whose output is lost must not exit with 0.

namespace hil::cli {

/// Flushes stdout. Returns `exit_code`, or exit_io_failed in place of exit_passed when anything printed so
/// far was lost (a full disk); the reason then goes to stderr.
int flush_output(const char* command, int exit_code);

}  // namespace hil::cli
