// state: killed: the process is killed and does not come back.

#include "runtime/run/fault_kinds.hpp"

namespace hil::run {
namespace {

class KilledFault final : public ProcessFault {
 public:
  std::string sentence() const override { return "killed"; }
  void set(ProcessWatch& processes, std::size_t process, const std::string& name,
           bool active) const noexcept override {
    if (active) processes.kill_for_fault(process, name);
  }
};

std::shared_ptr<const config::FaultEffect> read_killed(const config::Value& value,
                                                       const config::FaultContext& context) {
  const config::ActivationSection& activation = context.activation;
  if (activation.for_ns || activation.until || activation.active_while)
    context.diagnostics.add(value.place(), "a killed process does not come back, so its fault has no end");
  return std::make_shared<const KilledFault>();
}

}  // namespace

config::FaultKind killed_run_fault() {
  return {.target = config::FaultTarget::process,
          .key = "state",
          .word = "killed",
          .subject = "a process",
          .about = "killed",
          .read = read_killed};
}

}  // namespace hil::run
