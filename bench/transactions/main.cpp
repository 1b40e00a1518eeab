// hil-bench-transactions [--json] [--tiny] [--awake] [FAMILY...]: the cost of transactions, compared with
// alternatives.

#include "bench/figure/suite.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/side_by_side.hpp"
#include "bench/transactions/answers.hpp"
#include "bench/transactions/commits.hpp"
#include "bench/transactions/durability.hpp"
#include "bench/transactions/durable_commits.hpp"
#include "bench/transactions/log_bandwidth.hpp"
#include "bench/transactions/preemption.hpp"
#include "bench/transactions/recovery.hpp"
#include "bench/transactions/sqlite.hpp"

int main(int argc, char** argv) {
  constexpr hil::bench::Family families[] = {
      {"commits", hil::bench::measure_commits},
      {"answers", hil::bench::measure_answers},
      {"preemption", hil::bench::measure_preemption},
      {"durability", hil::bench::measure_durability},
      {"log_bandwidth", hil::bench::measure_log_bandwidth},
      {"durable_commits", hil::bench::measure_durable_commits},
      {"recovery", hil::bench::measure_recovery},
      {"sqlite", hil::bench::measure_sqlite},
  };
  hil::bench::limit_software_device();
  return hil::bench::run_suite("hil-bench-transactions", families, hil::bench::spatial_device, argc, argv);
}
