// hil-bench-images [--json] [--tiny] [--awake] [FAMILY...]: images, beside the same rays as queries.

#include "bench/figure/suite.hpp"
#include "bench/images/crossing.hpp"
#include "bench/images/first_hits.hpp"
#include "bench/images/path_tracer.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/side_by_side.hpp"

int main(int argc, char** argv) {
  constexpr hil::bench::Family families[] = {
      {"first_hits", hil::bench::measure_first_hits},
      {"path_tracer", hil::bench::measure_path_tracer},
      {"crossing", hil::bench::measure_crossing},
  };
  hil::bench::limit_software_device();
  return hil::bench::run_suite("hil-bench-images", families, hil::bench::spatial_device, argc, argv);
}
