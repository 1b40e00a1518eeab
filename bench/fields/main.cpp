// hil-bench-fields [--json] [--tiny] [--awake] [FAMILY...]: distance fields of geometries, and cones.

#include "bench/fields/builds.hpp"
#include "bench/fields/cones.hpp"
#include "bench/fields/memory.hpp"
#include "bench/figure/suite.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/side_by_side.hpp"

int main(int argc, char** argv) {
  constexpr hil::bench::Family families[] = {
      {"cones", hil::bench::measure_cones},
      {"field_builds", hil::bench::measure_field_builds},
      {"field_memory", hil::bench::measure_field_memory},
  };
  hil::bench::limit_software_device();
  return hil::bench::run_suite("hil-bench-fields", families, hil::bench::spatial_device, argc, argv);
}
