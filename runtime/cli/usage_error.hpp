#pragma once
// The error text for a command line that can not be parsed.

#include <CLI/CLI.hpp>

#include <string>

namespace hil::cli {

/// `error` is what parsing with `app` threw, and not a request for help or the version. The result begins
/// with the command ("hil run: "), names what is wrong and, for an unknown word, lists the known ones, the
/// nearest first.
std::string usage_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace hil::cli
