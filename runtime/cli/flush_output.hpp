#pragma once
// What a subcommand prints is what it is for: its exit code says when the output did not arrive.

namespace hil::cli {

/// Sends off what stdout still holds. The exit code given, or exit_io_failed in place of exit_passed when
/// anything printed so far was lost (a full disk), which stderr then says.
int flush_output(const char* command, int exit_code);

}  // namespace hil::cli
