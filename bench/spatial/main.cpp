// hil-bench-spatial [--json] [--tiny] [FAMILY...]: queries and structures beside the best of their kind on the
// CPU.

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <string_view>
#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/builds.hpp"
#include "bench/spatial/instances.hpp"
#include "bench/spatial/latency.hpp"
#include "bench/spatial/memory.hpp"
#include "bench/spatial/nearest.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/quality.hpp"
#include "bench/spatial/rays.hpp"
#include "bench/spatial/regions.hpp"

namespace {

using hil::bench::Figure;
using hil::bench::SpatialOptions;

struct Family {
  std::string_view name;
  std::vector<Figure> (*measure)(const SpatialOptions& options);
};

constexpr Family families[] = {
    {"rays", hil::bench::measure_rays},       {"instances", hil::bench::measure_instances},
    {"nearest", hil::bench::measure_nearest}, {"regions", hil::bench::measure_regions},
    {"builds", hil::bench::measure_builds},   {"latency", hil::bench::measure_latency},
    {"memory", hil::bench::measure_memory},   {"quality", hil::bench::measure_quality},
};

int refuse(const char* argument) {
  std::string known = "--json, --tiny";
  for (const Family& family : families)
    known += ", " + std::string(family.name);
  std::fprintf(stderr, "hil-bench-spatial: unknown argument '%s'; known: %s\n", argument, known.c_str());
  return 2;
}

void run(const std::vector<std::string_view>& wanted, const SpatialOptions& options, bool json) {
  hil::bench::limit_software_device();
  const std::string device = hil::bench::device_name() + "; " + hil::bench::spatial_device();
  for (const Family& family : families) {
    if (!wanted.empty() && std::ranges::find(wanted, family.name) == wanted.end()) continue;
    for (const Figure& figure : family.measure(options))
      std::printf("%s\n", (json ? as_json_line(figure, device) : as_text_line(figure)).c_str());
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  bool json = false;
  SpatialOptions options;
  std::vector<std::string_view> wanted;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--json") {
      json = true;
    } else if (argument == "--tiny") {
      options.tiny = true;
    } else if (std::ranges::find(families, argument, &Family::name) != std::end(families)) {
      wanted.push_back(argument);
    } else {
      return refuse(argv[i]);
    }
  }
  try {
    run(wanted, options, json);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hil-bench-spatial: %s\n", error.what());
    return 1;
  }
}
