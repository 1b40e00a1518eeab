// hil-bench-contact [--json] [--tiny] [--awake] [FAMILY...]: contacts of bodies.

#include "bench/contact/contacts.hpp"
#include "bench/figure/suite.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/side_by_side.hpp"

int main(int argc, char** argv) {
  constexpr hil::bench::Family families[] = {
      {"pairs", hil::bench::measure_pairs},
      {"broad_phase", hil::bench::measure_broad_phase},
      {"impacts", hil::bench::measure_impacts},
  };
  hil::bench::limit_software_device();
  return hil::bench::run_suite("hil-bench-contact", families, hil::bench::spatial_device, argc, argv);
}
