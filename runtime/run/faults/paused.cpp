// state: paused: the process is stopped (SIGSTOP) and continued.

#include "runtime/run/fault_kinds.hpp"

namespace hil::run {
namespace {

class PausedFault final : public ProcessFault {
 public:
  std::string sentence() const override { return "paused"; }
  void set(ProcessWatch& processes, std::size_t process, const std::string& /*name*/,
           bool active) const noexcept override {
    processes.set_paused(process, active);
  }
};

std::shared_ptr<const config::FaultEffect> read_paused(const config::Value& /*value*/,
                                                       const config::FaultContext& /*context*/) {
  return std::make_shared<const PausedFault>();
}

}  // namespace

config::FaultKind paused_run_fault() {
  return {.target = config::FaultTarget::process,
          .key = "state",
          .word = "paused",
          .subject = "a process",
          .about = "paused",
          .read = read_paused};
}

}  // namespace hil::run
