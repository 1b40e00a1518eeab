#include "bench/figure/suite.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <stdexcept>

#include "runtime/executive/realtime.hpp"

namespace hil::bench {

namespace {

int refuse(const std::string& program, std::span<const Family> families, const char* argument) {
  std::string known = "--json, --tiny, --awake";
  for (const Family& family : families)
    known += ", " + std::string(family.name);
  std::fprintf(stderr, "%s: unknown argument '%s'; known: %s\n", program.c_str(), argument, known.c_str());
  return 2;
}

}  // namespace

int run_suite(const std::string& program, std::span<const Family> families, std::string (*device)(), int argc,
              char** argv) {
  bool json = false;
  bool awake = false;
  SuiteOptions options;
  std::vector<std::string_view> wanted;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--json") {
      json = true;
    } else if (argument == "--tiny") {
      options.tiny = true;
    } else if (argument == "--awake") {
      awake = true;
    } else if (std::ranges::find(families, argument, &Family::name) != families.end()) {
      wanted.push_back(argument);
    } else {
      return refuse(program, families, argv[i]);
    }
  }
  try {
    executive::RealtimeOptions realtime;
    if (awake) realtime.scheduler = executive::Scheduler::fifo;
    const executive::ProcessRealtime kept(realtime);
    if (!kept.refused().empty()) throw std::runtime_error(kept.refused().front());
    const std::string where = device_name() + "; " + device() + (awake ? "; processors kept awake" : "");
    for (const Family& family : families) {
      if (!wanted.empty() && std::ranges::find(wanted, family.name) == wanted.end()) continue;
      for (const Figure& figure : family.measure(options))
        std::printf("%s\n", (json ? as_json_line(figure, where) : as_text_line(figure)).c_str());
      std::fflush(stdout);
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", program.c_str(), error.what());
    return 1;
  }
}

}  // namespace hil::bench
