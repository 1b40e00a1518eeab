#include "runtime/run/fault_kinds.hpp"

#include "runtime/injection/signal_fault.hpp"

namespace hil::run {

#define RUN_FAULT(name) config::FaultKind name##_run_fault();
#include "runtime/run/faults/table.def"
#undef RUN_FAULT

std::vector<config::FaultKind> fault_kinds() {
  std::vector<config::FaultKind> kinds = injection::signal_fault_kinds();
#define RUN_FAULT(name) kinds.push_back(name##_run_fault());
#include "runtime/run/faults/table.def"
#undef RUN_FAULT
  return kinds;
}

}  // namespace hil::run
