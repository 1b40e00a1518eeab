// hil-bench-spatial [--json] [--tiny] [--awake] [FAMILY...]: queries and structures compared with CPU
// libraries.

#include "bench/figure/suite.hpp"
#include "bench/spatial/builds.hpp"
#include "bench/spatial/instances.hpp"
#include "bench/spatial/latency.hpp"
#include "bench/spatial/memory.hpp"
#include "bench/spatial/nearest.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/quality.hpp"
#include "bench/spatial/rays.hpp"
#include "bench/spatial/regions.hpp"
#include "bench/spatial/side_by_side.hpp"

int main(int argc, char** argv) {
  constexpr hil::bench::Family families[] = {
      {"rays", hil::bench::measure_rays},       {"instances", hil::bench::measure_instances},
      {"nearest", hil::bench::measure_nearest}, {"regions", hil::bench::measure_regions},
      {"builds", hil::bench::measure_builds},   {"latency", hil::bench::measure_latency},
      {"memory", hil::bench::measure_memory},   {"quality", hil::bench::measure_quality},
  };
  hil::bench::limit_software_device();
  return hil::bench::run_suite("hil-bench-spatial", families, hil::bench::spatial_device, argc, argv);
}
