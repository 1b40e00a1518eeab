// takes_longer: each step of a task takes longer by a duration.

#include <hil/quantity.hpp>

#include "runtime/config/shared_schemas.hpp"
#include "runtime/run/fault_kinds.hpp"

namespace hil::run {
namespace {

class LongerStepsSwitch final : public injection::FaultSwitch {
 public:
  LongerStepsSwitch(ModuleTask& task, std::int64_t period_ns, std::int64_t added_ns)
      : task_(task), period_ns_(period_ns), added_ns_(added_ns) {}
  void set(bool active) noexcept override {
    // While this fault is active, every lengthened step is lengthened by it, also when other faults of the
    // task are active.
    if (!active) longer_steps_ += task_.longer_steps() - longer_before_;
    longer_before_ = task_.longer_steps();
    is_active_ = active;
    task_.add_duration(active ? added_ns_ : -added_ns_);
  }
  injection::FaultOutcome outcome() const override {
    const std::uint64_t longer = longer_steps_ + (is_active_ ? task_.longer_steps() - longer_before_ : 0);
    if (longer > 0) return {.took_effect = true};
    return {.took_effect = false,
            .missing =
                "no step of the task was in that time (every " + config::format_duration(period_ns_) + ")"};
  }

 private:
  ModuleTask& task_;
  const std::int64_t period_ns_, added_ns_;
  bool is_active_ = false;
  std::uint64_t longer_steps_ = 0, longer_before_ = 0;
};

class TakesLongerFault final : public TaskFault {
 public:
  explicit TakesLongerFault(std::int64_t added_ns) : added_ns_(added_ns) {}
  std::string sentence() const override {
    return "with steps that take " + config::format_duration(added_ns_) + " longer";
  }
  std::unique_ptr<injection::FaultSwitch> make_switch(ModuleTask& task,
                                                      std::int64_t period_ns) const override {
    return std::make_unique<LongerStepsSwitch>(task, period_ns, added_ns_);
  }
  std::int64_t aftermath_ns() const noexcept override { return added_ns_; }

 private:
  const std::int64_t added_ns_;
};

config::Schema takes_longer_schema() {
  return config::duration_schema(config::min_duration_s);
}

std::shared_ptr<const config::FaultEffect> read_takes_longer(const config::Value& value,
                                                             const config::FaultContext& /*context*/) {
  return std::make_shared<const TakesLongerFault>(value.duration_ns());
}

}  // namespace

config::FaultKind takes_longer_run_fault() {
  return {.target = config::FaultTarget::task,
          .key = "takes_longer",
          .about = "Of a task: how much longer each step takes.",
          .schema = takes_longer_schema,
          .read = read_takes_longer};
}

}  // namespace hil::run
